#include "viewer/window/panels.h"

#include "viewer/scene/minimap.h"
#include "viewer/window/bindings.h"
#include "viewer/window/internal/text_format.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <imgui.h>

namespace filiform {

namespace {

using internal::format;

// Over dense tissue text is lost on anything more transparent.
constexpr float kPanelAlpha = 0.88F;

constexpr ImU32 kInk = IM_COL32(225, 230, 240, 255), kDim = IM_COL32(150, 158, 172, 255),
                kGold = IM_COL32(235, 200, 90, 255), kRed = IM_COL32(240, 110, 95, 255);

ImVec2 vec(double x, double y) { return {static_cast<float>(x), static_cast<float>(y)}; }

std::string count(std::uint64_t n) {
  std::string text = std::to_string(n);
  for (std::size_t i = text.size(); i > 3; i -= 3) text.insert(i - 3, " ");
  return text;
}

std::string bytes(double n) {
  if (n < 1024) return format("%.0f B", n);
  if (n < 1024.0 * 1024) return format("%.1f KiB", n / 1024);
  if (n < 1024.0 * 1024 * 1024) return format("%.1f MiB", n / 1024 / 1024);
  return format("%.1f GiB", n / 1024 / 1024 / 1024);
}

std::string length(double um) {
  if (um >= 1000) return format("%.3g mm", um / 1000);
  if (um >= 0.1) return format("%.4g um", um);
  return format("%.3g nm", um * 1000);
}

ImU32 colourOf(TileState state) {
  switch (state) {
    case TileState::queued:
      return IM_COL32(110, 120, 150, 255);
    case TileState::reading:
      return IM_COL32(240, 200, 80, 255);
    case TileState::ready:
      return IM_COL32(120, 190, 240, 255);
    case TileState::resident:
      return IM_COL32(90, 200, 120, 255);
    case TileState::retiring:
      return IM_COL32(160, 110, 200, 255);
    case TileState::failed:
      return IM_COL32(240, 80, 70, 255);
    case TileState::absent:
      break;
  }
  return IM_COL32(58, 64, 78, 255);
}

constexpr ImGuiWindowFlags kStill = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                    ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_AlwaysAutoResize |
                                    ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;

// Over the picture, readable on whatever lies behind.
void write(ImDrawList& list, const ImVec2& at, ImU32 colour, const std::string& text) {
  const ImU32 shade = IM_COL32(0, 0, 0, 200);
  for (const auto& [dx, dy] : {std::pair{1, 0}, std::pair{-1, 0}, std::pair{0, 1}, std::pair{0, -1}})
    list.AddText(vec(at.x + static_cast<float>(dx), at.y + static_cast<float>(dy)), shade, text.c_str());
  list.AddText(at, colour, text.c_str());
}

// The beginning of a text, as far as it fits; a sign says where it is cut.
std::string fitted(const std::string& text, float width) {
  if (ImGui::CalcTextSize(text.c_str()).x <= width) return text;
  const std::string sign = ImGui::GetFont()->FindGlyphNoFallback(0x2026) != nullptr ? "\u2026" : "...";
  std::size_t fits = 0, beyond = text.size();  // bytes
  while (beyond - fits > 1) {
    const std::size_t middle = (fits + beyond) / 2;
    if (ImGui::CalcTextSize((text.substr(0, middle) + sign).c_str()).x <= width)
      fits = middle;
    else
      beyond = middle;
  }
  while (fits > 0 && (static_cast<unsigned char>(text[fits]) & 0xC0U) == 0x80U) --fits;  // a whole character
  return text.substr(0, fits) + sign;
}

void showWhole(const std::string& text, double scale) {
  ImGui::BeginTooltip();
  ImGui::PushTextWrapPos(static_cast<float>(600 * scale));
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
  ImGui::EndTooltip();
}

// As far as it fits; whole while the pointer is on it.
void showFitted(const std::string& text, double width, double scale) {
  const std::string shown = fitted(text, static_cast<float>(width));
  ImGui::TextUnformatted(shown.c_str());
  if (shown.size() == text.size()) return;
  // Also in panels that take no input.
  const ImVec2 lo = ImGui::GetItemRectMin(), hi = ImGui::GetItemRectMax(), at = ImGui::GetIO().MousePos;
  if (at.x >= lo.x && at.x < hi.x && at.y >= lo.y && at.y < hi.y) showWhole(text, scale);
}

constexpr double kForceWidth = 260, kStatusColumn = 82;  // times the scale

void drawStatus(const PanelData& d, bool beside_force) {
  ImGui::SetNextWindowPos(vec(10 * d.scale, 10 * d.scale));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  ImGui::Begin("status", nullptr, kStill | ImGuiWindowFlags_NoInputs);
  const double right = d.size.width - (beside_force ? (kForceWidth + 50) * d.scale : 10 * d.scale);
  const double width = std::max(80 * d.scale, right - 10 * d.scale - 2 * ImGui::GetStyle().WindowPadding.x);
  showFitted(d.scene, width, d.scale);
  const auto row = [&](const char* what, const std::string& value) {
    if (value.empty()) return;
    ImGui::PushStyleColor(ImGuiCol_Text, kDim);
    ImGui::TextUnformatted(what);
    ImGui::PopStyleColor();
    ImGui::SameLine(static_cast<float>(kStatusColumn * d.scale));
    showFitted(value, width - (kStatusColumn - 8) * d.scale, d.scale);
  };
  row("cell", d.cell);
  row("place", d.place);
  row("hand", d.device + ", " + d.mode);
  row("across", length(d.zoom_um));
  row("force", format("%.2f N", d.force_N));
  row("measure", d.measure);
  std::string drawn = count(d.segments) + " segments";
  if (std::isinf(d.error_px))
    drawn += ", coarse at the eye";
  else if (d.error_px > 0)
    drawn += format(", error %.1f px", d.error_px);
  row("drawn", drawn);
  row("left out", d.left_out > 0 ? count(d.left_out) + " segments" : std::string());
  row("to come", d.pending > 0 ? count(d.pending) + (d.pending == 1 ? " tile" : " tiles") : std::string());
  row("stereo", d.stereo);
  if (d.frozen) ImGui::TextColored({0.92F, 0.78F, 0.35F, 1}, "levels of detail are frozen (l)");
  ImGui::End();
}

// Where lines are written over the picture: between these two, pixels.
struct Lines {
  double left, right;
};

// A line at the lower rim, broken where the room ends, on a ground of its own; above the last one.
void drawLine(ImDrawList& list, const Lines& room, double scale, ImU32 colour, const std::string& text,
              double& bottom) {
  const double widest = std::max(60.0, std::min(room.right - room.left, 760 * scale)), rim = 4 * scale;
  const ImVec2 taken = ImGui::CalcTextSize(text.c_str(), nullptr, false, static_cast<float>(widest));
  const double left = (room.left + room.right - taken.x) / 2.0, top = bottom - taken.y - 2 * rim;
  list.AddRectFilled(vec(left - 2 * rim, top), vec(left + taken.x + 2 * rim, bottom), IM_COL32(13, 15, 20, 215),
                     static_cast<float>(rim));
  list.AddText(ImGui::GetFont(), ImGui::GetFontSize(), vec(left, top + rim), colour, text.c_str(), nullptr,
               static_cast<float>(widest));
  bottom = top - rim / 2;
}

void drawMessages(const PictureSize& size, double scale, const Lines& room, const std::vector<std::string>& messages,
                  const std::string& hint) {
  // Over the picture, and under what is open.
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  double bottom = size.height - 8 * scale;
  if (!hint.empty()) drawLine(list, room, scale, kDim, hint, bottom);
  for (std::size_t i = messages.size(); i-- > 0;) drawLine(list, room, scale, kGold, messages[i], bottom);
}

// A bar of round length, at the rim where no panel lies.
void drawScaleBar(const PanelData& d) {
  if (!(d.um_px > 0) || !std::isfinite(d.um_px) || d.size.width < 100 * d.scale) return;
  const ScaleBar bar = scaleBar(d.um_px, std::min(220 * d.scale, d.size.width / 4.0));
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const double right = d.size.width - 20 * d.scale, left = right - bar.length_px, y = d.size.height - 22 * d.scale;
  const auto thick = static_cast<float>(2 * d.scale);
  list.AddLine(vec(left, y), vec(right, y), kInk, thick);
  list.AddLine(vec(left, y - 5 * d.scale), vec(left, y + 5 * d.scale), kInk, thick);
  list.AddLine(vec(right, y - 5 * d.scale), vec(right, y + 5 * d.scale), kInk, thick);
  const ImVec2 size = ImGui::CalcTextSize(bar.text.c_str());
  write(list, vec((left + right - size.x) / 2, y - 8 * d.scale - size.y), kInk, bar.text);
}

// Among everything the proxy is a point: a ring and a word say where.
void drawHere(const PanelData& d) {
  if (!d.overview || !d.proxy || !(d.proxy->depth_um > 0)) return;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const auto radius = static_cast<float>(11 * d.scale), thick = static_cast<float>(2 * d.scale);
  const ImVec2 at = vec(d.proxy->x, d.proxy->y);
  list.AddCircle(at, radius, IM_COL32(0, 0, 0, 200), 32, 2 * thick);
  list.AddCircle(at, radius, kGold, 32, thick);
  write(list, vec(at.x + 15 * d.scale, at.y - 7 * d.scale), kGold, "proxy");
}

void drawPull(const PanelData& d) {
  if (!d.proxy || !d.hand || !(d.proxy->depth_um > 0) || !(d.hand->depth_um > 0)) return;
  const double dx = d.hand->x - d.proxy->x, dy = d.hand->y - d.proxy->y;
  if (std::hypot(dx, dy) < 4 * d.scale) return;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const double part = std::clamp(d.force_N / 4, 0.0, 1.0);
  const ImU32 colour = IM_COL32(static_cast<int>(120 + 135 * part), static_cast<int>(220 - 120 * part), 110, 255);
  const auto thick = static_cast<float>((1.5 + 3 * part) * d.scale);
  list.AddLine(vec(d.proxy->x, d.proxy->y), vec(d.hand->x, d.hand->y), colour, thick);
  list.AddCircle(vec(d.hand->x, d.hand->y), static_cast<float>(6 * d.scale), colour, 24, thick);
  write(list, vec(d.hand->x + 10 * d.scale, d.hand->y - 6 * d.scale), kInk, format("%.2f N", d.force_N));
}

void drawForce(const PanelData& d) {
  const double width = kForceWidth * d.scale, height = 90 * d.scale;
  ImGui::SetNextWindowPos(vec(d.size.width - 10 * d.scale, 10 * d.scale), ImGuiCond_Always, vec(1, 0));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  ImGui::Begin("force", nullptr, kStill | ImGuiWindowFlags_NoInputs);
  ImGui::Text("force %.2f N, the last 4 s", d.force_N);
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImGui::Dummy(vec(width, height));
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const std::vector<float>& forces = *d.forces_N;
  double top = 0.5;
  for (const float force : forces) top = std::max(top, static_cast<double>(force));
  top = top <= 1 ? 1 : top <= 2 ? 2 : top <= 4 ? 4 : 8;
  for (int line = 0; line <= 2; ++line) {
    const double y = at.y + height * (1 - line / 2.0);
    list.AddLine(vec(at.x, y), vec(at.x + width, y), IM_COL32(90, 98, 115, 140));
  }
  list.AddText(vec(at.x, at.y), kDim, format("%g N", top).c_str());
  list.AddText(vec(at.x, at.y + height / 2), kDim, format("%g", top / 2).c_str());
  list.AddText(vec(at.x, at.y + height - ImGui::GetTextLineHeight()), kDim, "0");
  // The largest of each pixel's ticks, so that no peak is missed.
  constexpr std::size_t kTicks = 4000;
  const auto columns = static_cast<std::size_t>(width);
  ImVec2 last{};
  for (std::size_t column = 0; column < columns; ++column) {
    const std::size_t begin = column * kTicks / columns, end = (column + 1) * kTicks / columns;
    float most = 0;
    for (std::size_t back = kTicks - end; back < kTicks - begin && back < forces.size(); ++back)
      most = std::max(most, forces[forces.size() - 1 - back]);
    const ImVec2 point = vec(at.x + static_cast<double>(column), at.y + height * (1 - std::min(1.0, most / top)));
    if (column > 0) list.AddLine(last, point, kGold, static_cast<float>(1.3 * d.scale));
    last = point;
  }
  ImGui::End();
}

void drawPicture(const PanelData& d, PanelRequests& requests) {
  if (d.picture.empty()) return;
  ImGui::SetNextWindowPos(vec(d.size.width - 10 * d.scale, d.size.height - 60 * d.scale), ImGuiCond_Always, vec(1, 1));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  ImGui::Begin("picture", nullptr, kStill);
  ImGui::TextUnformatted(d.picture.c_str());
  if (d.picture_part >= 0) {
    ImGui::ProgressBar(static_cast<float>(d.picture_part), vec(220 * d.scale, 0));
    requests.cancel_picture = ImGui::Button("cancel (Esc)");
  }
  ImGui::End();
}

void drawMap(const PanelData& d, ImDrawList& list, const Minimap& map, const ImVec2& at, bool whole) {
  const auto place = [&](double x, double y) { return vec(at.x + x, at.y + y); };
  const Minimap::Box all = map.box(d.lo_W, d.hi_W);
  list.AddRect(place(all.left, all.top), place(all.right, all.bottom), IM_COL32(120, 135, 160, 255));
  if (whole && d.visited_W.size() > 1)
    for (std::size_t i = 1; i < d.visited_W.size(); ++i)
      list.AddLine(place(map.x(d.visited_W[i - 1]), map.y(d.visited_W[i - 1])),
                   place(map.x(d.visited_W[i]), map.y(d.visited_W[i])), IM_COL32(235, 200, 90, 70));
  if (whole) {
    const Minimap::Box nested = map.box(d.centre_W, 10 * d.zoom_um, 0);
    list.AddRect(place(nested.left, nested.top), place(nested.right, nested.bottom), IM_COL32(120, 135, 160, 150));
  }
  const Minimap::Box space = map.box(d.centre_W, d.zoom_um, 5 * d.scale);
  list.AddRect(place(space.left, space.top), place(space.right, space.bottom), kGold);
  for (std::size_t i = 0; i < d.bookmarks_W.size(); ++i) {
    const ImVec2 mark = place(map.x(d.bookmarks_W[i]), map.y(d.bookmarks_W[i]));
    list.AddCircleFilled(mark, static_cast<float>(2.5 * d.scale), IM_COL32(110, 190, 255, 255));
    list.AddText(vec(mark.x + 3 * d.scale, mark.y - 6 * d.scale), IM_COL32(110, 190, 255, 255),
                 d.bookmark_names[i].c_str());
  }
  list.AddCircleFilled(place(map.x(d.proxy_W), map.y(d.proxy_W)), static_cast<float>(2.5 * d.scale), kInk);
}

// `right`: where it ends, pixels.
std::optional<Vector3d> drawMinimap(const PanelData& d, double& right) {
  const double side = 170 * d.scale;
  if (d.size.width < 2.5 * side || d.size.height < 3.5 * side) return std::nullopt;
  ImGui::SetNextWindowPos(vec(10 * d.scale, d.size.height - 10 * d.scale), ImGuiCond_Always, vec(0, 1));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  ImGui::Begin("minimap", nullptr, kStill);
  std::optional<Vector3d> clicked;
  const Minimap whole(d.lo_W, d.hi_W, side, side);
  const Minimap near = whole.around(d.centre_W, d.zoom_um, side / 2, side / 2);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  ImGui::TextColored({0.6F, 0.63F, 0.69F, 1}, "everything, from the front");
  const auto map = [&](const char* name, const Minimap& shown, double across, bool all) {
    const ImVec2 at = ImGui::GetCursorScreenPos();
    if (ImGui::InvisibleButton(name, vec(across, across))) {
      const ImVec2 mouse = ImGui::GetIO().MousePos;
      clicked = shown.toWorld(mouse.x - at.x, mouse.y - at.y, d.proxy_W.z());
    }
    list.PushClipRect(at, vec(at.x + across, at.y + across), true);
    list.AddRectFilled(at, vec(at.x + across, at.y + across), IM_COL32(0, 0, 0, 60));
    drawMap(d, list, shown, at, all);
    list.PopClipRect();
  };
  map("whole", whole, side, true);
  if (d.zoom_um * 10 < 0.7 * (d.hi_W - d.lo_W).head<2>().maxCoeff()) {
    ImGui::SameLine();
    map("near", near, side / 2, false);
  }
  right = ImGui::GetWindowPos().x + ImGui::GetWindowSize().x;
  ImGui::End();
  return clicked;
}

void drawTiles(const PanelData& d, const TilePanel& t) {
  ImGui::SetNextWindowPos(vec(d.size.width - 10 * d.scale, 150 * d.scale), ImGuiCond_FirstUseEver, vec(1, 0));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  ImGui::Begin("tiles and memory", nullptr,
               ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav);
  // It grows with what it shows.
  const ImVec2 at_first = ImGui::GetWindowPos(), taken = ImGui::GetWindowSize();
  const double inside = d.size.width - 10 * d.scale - taken.x;
  if (at_first.x > inside) ImGui::SetWindowPos(vec(std::max(0.0, inside), at_first.y));
  if (t.in_memory) {
    ImGui::Text("all %s tiles lie in memory", count(t.tiles).c_str());
  } else {
    const ResidencyCounters& c = t.counters;
    const auto row = [&](const char* what, const std::string& value) {
      ImGui::TextUnformatted(what);
      ImGui::SameLine(static_cast<float>(100 * d.scale));
      ImGui::TextUnformatted(value.c_str());
    };
    ImGui::Text("%s tiles; the hand's:", count(t.tiles).c_str());
    for (int i = 0; i < 7; ++i) {
      const auto state = static_cast<TileState>(i);
      if (t.counts[i] == 0 && state != TileState::resident) continue;
      ImGui::ColorButton(toString(state), ImColor(colourOf(state)), ImGuiColorEditFlags_NoTooltip,
                         vec(10 * d.scale, 10 * d.scale));
      ImGui::SameLine();
      row(toString(state), count(t.counts[i]));
    }
    std::string budget = bytes(static_cast<double>(c.bytes));
    budget += t.budget_bytes == UINT64_MAX ? " (no limit)" : " of " + bytes(static_cast<double>(t.budget_bytes));
    row("memory", budget);
    if (t.budget_bytes != UINT64_MAX)
      ImGui::ProgressBar(static_cast<float>(static_cast<double>(c.bytes) / static_cast<double>(t.budget_bytes)),
                         vec(240 * d.scale, 6 * d.scale), "");
    row("read", format("%s tiles, %.0f a s, %s/s", count(c.reads).c_str(), t.reads_s, bytes(t.read_bytes_s).c_str()));
    row("dropped", count(c.evictions) + " tiles");
    row("frontiers", count(t.frontiers) + " ticks");
    ImGui::PushTextWrapPos(static_cast<float>(360 * d.scale));
    for (const std::string& failure : t.failures) ImGui::TextColored({0.94F, 0.43F, 0.37F, 1}, "%s", failure.c_str());
    ImGui::PopTextWrapPos();
  }
  if (!t.boxes.empty()) {
    const double side = 260 * d.scale;
    Vector3d lo = Vector3d::Constant(1e300), hi = -lo;
    for (const TilePanel::Box& box : t.boxes) {
      lo = lo.cwiseMin(Vector3d(box.lo_x, box.lo_y, 0));
      hi = hi.cwiseMax(Vector3d(box.hi_x, box.hi_y, 0));
    }
    const Minimap map(lo, hi, side, side);
    const ImVec2 at = ImGui::GetCursorScreenPos();
    ImGui::Dummy(vec(side, side));
    ImDrawList& list = *ImGui::GetWindowDrawList();
    for (const TilePanel::Box& box : t.boxes) {
      const Minimap::Box b = map.box(Vector3d(box.lo_x, box.lo_y, 0), Vector3d(box.hi_x, box.hi_y, 0));
      const ImU32 colour = colourOf(box.state);
      const ImVec2 from = vec(at.x + b.left, at.y + b.top), to = vec(at.x + b.right, at.y + b.bottom);
      if (box.state != TileState::absent) list.AddRectFilled(from, to, (colour & 0x00FFFFFFU) | 0x60000000U);
      list.AddRect(from, to, colour);
    }
    list.AddCircleFilled(vec(at.x + map.x(d.proxy_W), at.y + map.y(d.proxy_W)), static_cast<float>(3 * d.scale), kInk);
    ImGui::PushTextWrapPos(static_cast<float>(side));
    ImGui::TextColored({0.6F, 0.63F, 0.69F, 1}, "%s tiles nearest to the proxy, from the front",
                       count(t.boxes.size()).c_str());
    ImGui::PopTextWrapPos();
  }
  ImGui::End();
}

// What a binding's key does, for the help.
std::string doneBy(const Binding& binding) {
  std::string text = binding.what;
  if (binding.held == Held::repeats) text += " (repeats while held)";
  if (binding.held == Held::pushes) text += " (while held)";
  return text;
}

// Two columns of a table: inputs, and what they do; each as wide as its longest line.
struct HelpTable {
  const char* name;
  std::vector<const char*> groups;
  float inputs = 0, done = 0;

  void measure() {
    const auto width = [](const std::string& text) { return ImGui::CalcTextSize(text.c_str()).x + 1; };
    for (const Binding& binding : bindings()) {
      if (!has(binding)) continue;
      inputs = std::max(inputs, width(inputsOf(binding)));
      done = std::max(done, width(doneBy(binding)));
    }
  }
  bool has(const Binding& binding) const {
    return std::any_of(groups.begin(), groups.end(),
                       [&](const char* group) { return std::strcmp(binding.group, group) == 0; });
  }
  // Longer lines are broken.
  void fit(float width) {
    inputs = std::min(inputs, 0.5F * width);
    done = std::min(done, width - inputs);
  }
  void show() const {
    if (!ImGui::BeginTable(name, 2, ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_NoHostExtendX)) return;
    ImGui::TableSetupColumn("inputs", ImGuiTableColumnFlags_WidthFixed, inputs);
    ImGui::TableSetupColumn("done", ImGuiTableColumnFlags_WidthFixed, done);
    for (const char* group : groups) {
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      ImGui::TextColored({0.92F, 0.78F, 0.35F, 1}, "%s", group);
      for (const Binding& binding : bindings()) {
        if (std::strcmp(binding.group, group) != 0) continue;
        ImGui::TableNextRow();
        for (const std::string& text : {inputsOf(binding), doneBy(binding)}) {
          ImGui::TableNextColumn();
          ImGui::PushTextWrapPos(0);
          ImGui::TextUnformatted(text.c_str());
          ImGui::PopTextWrapPos();
        }
      }
    }
    ImGui::EndTable();
  }
};

void drawHelp(const PanelData& d, bool& open) {
  const ImVec2 most = vec(d.size.width * 0.96, d.size.height * 0.94);
  ImGui::SetNextWindowPos(vec(d.size.width / 2.0, d.size.height / 2.0), ImGuiCond_Always, vec(0.5, 0.5));
  ImGui::SetNextWindowSizeConstraints(vec(0, 0), most);
  ImGui::SetNextWindowBgAlpha(1);
  ImGui::Begin("keys and mouse", &open,
               ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoCollapse);
  HelpTable left{"left", {"Hand", "Travel"}}, right{"right", {"View", "Window"}};
  left.measure();
  right.measure();
  const ImGuiStyle& style = ImGui::GetStyle();
  const auto gap = static_cast<float>(24 * d.scale);
  const float rim = 4 * style.CellPadding.x;  // of one table
  const float room = most.x - 2 * style.WindowPadding.x - style.ScrollbarSize;
  // Side by side where no line has to be broken more than once.
  const float beside = room - gap - 2 * rim, natural = left.inputs + left.done + right.inputs + right.done;
  const bool wide = beside >= 0.6F * natural;
  if (wide) {
    const float part = std::min(1.0F, beside / natural);
    left.fit(part * (left.inputs + left.done));
    right.fit(part * (right.inputs + right.done));
  } else {
    left.fit(room - rim);
    right.fit(room - rim);
  }
  left.show();
  if (wide) ImGui::SameLine(0, gap);
  right.show();
  ImGui::End();
}

void drawSearch(const PanelData& d, bool& open, SearchPanel& search, PanelRequests& requests) {
  ImGui::SetNextWindowPos(vec(d.size.width / 2.0, d.size.height * 0.15), ImGuiCond_Always, vec(0.5, 0));
  ImGui::SetNextWindowSize(vec(std::min(520 * d.scale, d.size.width * 0.9), 0));
  ImGui::Begin("go to", &open,
               ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoResize);
  ImGui::TextColored({0.6F, 0.63F, 0.69F, 1}, "a cell's name or a part of it, CELL:SAMPLE, or X Y Z in um; Enter");
  if (search.focus) ImGui::SetKeyboardFocusHere();
  search.focus = false;
  std::array<char, 1024> text{};
  search.text.copy(text.data(), text.size() - 1);
  ImGui::SetNextItemWidth(-1);
  const bool entered = ImGui::InputText("##query", text.data(), text.size(), ImGuiInputTextFlags_EnterReturnsTrue);
  if (search.text != text.data()) {
    search.text = text.data();
    search.error.clear();
    requests.search_changed = true;
  }
  if (entered) requests.go = search.text;
  for (std::size_t i = 0; i < search.names.size(); ++i) {
    // The name is no label: Dear ImGui takes what follows "##" in one for its own.
    const std::string& name = search.names[i];
    ImGui::PushID(static_cast<int>(i));
    const ImVec2 at = ImGui::GetCursorScreenPos();
    const std::string shown = fitted(name, ImGui::GetContentRegionAvail().x);
    if (ImGui::Selectable("##name")) requests.go = name;
    if (shown.size() != name.size() && ImGui::IsItemHovered()) showWhole(name, d.scale);
    ImGui::GetWindowDrawList()->AddText(at, ImGui::GetColorU32(ImGuiCol_Text), shown.c_str());
    ImGui::PopID();
  }
  ImGui::PushTextWrapPos(0);
  if (!search.error.empty()) ImGui::TextColored({0.94F, 0.43F, 0.37F, 1}, "%s", search.error.c_str());
  ImGui::PopTextWrapPos();
  ImGui::End();
}

void drawSettings(const PanelData& d, bool& open, Settings& settings, PanelRequests& requests) {
  ImGui::SetNextWindowPos(vec(10 * d.scale, 180 * d.scale), ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowBgAlpha(0.92F);
  ImGui::Begin("settings", &open, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings);
  const auto choose = [&](const char* what, auto& value, const auto& choices) {
    if (!ImGui::BeginCombo(what, toString(value))) return;
    for (const auto one : choices)
      if (ImGui::Selectable(toString(one), one == value)) {
        value = one;
        requests.settings_changed = true;
      }
    ImGui::EndCombo();
  };
  choose("colour by", settings.colouring, kColourings);
  choose("stereo", settings.stereo, kStereoModes);
  const auto slide = [&](const char* what, double& value, float least, float most) {
    auto shown = static_cast<float>(value);
    if (!ImGui::SliderFloat(what, &shown, least, most, "%.2f")) return;
    value = std::clamp(shown, least, most);
    requests.settings_changed = true;
  };
  slide("separation of the eyes", settings.separation, 0, 2);
  slide("widening of the angle", settings.widening, 0.5F, 2);
  slide("size of letters", settings.interface_scale, 0.5F, 4);
  requests.settings_changed |= ImGui::Checkbox("as from far away (orthographic)", &settings.orthographic);
  requests.settings_changed |= ImGui::Checkbox("fork in blue and orange", &settings.orange_blue);
  requests.settings_changed |= ImGui::Checkbox("reduced motion", &settings.reduced_motion);
  if (ImGui::Button("reset to defaults")) requests.reset = true;
  ImGui::End();
}

}  // namespace

PanelRequests drawPanels(const PanelData& d, const TilePanel& tiles, OpenPanels& open, SearchPanel& search,
                         Settings& settings) {
  PanelRequests requests;
  drawHere(d);
  drawPull(d);
  drawScaleBar(d);
  Lines room{0, d.size.width - std::min(220 * d.scale, d.size.width / 4.0) - 20 * d.scale};  // beside the scale bar
  const bool has_force = settings.show_force && d.forces_N != nullptr && d.size.width >= 420 * d.scale;
  if (d.size.width >= 240 * d.scale && d.size.height >= 200 * d.scale) drawStatus(d, has_force);
  if (has_force) drawForce(d);
  drawPicture(d, requests);
  if (settings.show_minimap) requests.go_to_W = drawMinimap(d, room.left);
  if (settings.show_tiles) drawTiles(d, tiles);
  if (open.settings) drawSettings(d, open.settings, settings, requests);
  if (open.search) drawSearch(d, open.search, search, requests);
  if (open.help) drawHelp(d, open.help);
  // In the middle of the window where that is as wide.
  room.left = std::max(room.left, d.size.width - room.right) + 20 * d.scale;
  if (room.right - room.left < 240 * d.scale) room = {20 * d.scale, d.size.width - 20 * d.scale};
  drawMessages(d.size, d.scale, room, d.messages, open.help ? std::string() : d.hint);
  if (!d.tooltip.empty()) {
    ImDrawList& list = *ImGui::GetForegroundDrawList();
    const auto widest = static_cast<float>(std::max(60.0, std::min(d.size.width - 24 * d.scale, 600 * d.scale)));
    const ImVec2 size = ImGui::CalcTextSize(d.tooltip.c_str(), nullptr, false, widest);
    const double x = std::min(d.tooltip_x + 14 * d.scale, d.size.width - size.x - 12 * d.scale);
    const double y = std::min(d.tooltip_y + 16 * d.scale, d.size.height - size.y - 12 * d.scale);
    list.AddRectFilled(vec(x - 6 * d.scale, y - 4 * d.scale), vec(x + size.x + 6 * d.scale, y + size.y + 4 * d.scale),
                       IM_COL32(20, 23, 31, 235), static_cast<float>(4 * d.scale));
    list.AddText(ImGui::GetFont(), ImGui::GetFontSize(), vec(x, y), kInk, d.tooltip.c_str(), nullptr, widest);
  }
  return requests;
}

void drawOpening(const PictureSize& size, double scale, const std::string& what, double since_s,
                 const std::vector<std::string>& messages) {
  drawMessages(size, scale, {20 * scale, size.width - 20 * scale}, messages, {});
  ImGui::SetNextWindowPos(vec(size.width / 2.0, size.height / 2.0), ImGuiCond_Always, vec(0.5, 0.5));
  ImGui::Begin("opening", nullptr, kStill);
  showFitted(what, size.width - 40 * scale, scale);
  if (since_s >= 0) {
    // How much there is to do is not known: the bar goes round.
    ImGui::ProgressBar(static_cast<float>(since_s - std::floor(since_s)), vec(320 * scale, 8 * scale), "");
    ImGui::Text("%.0f s", since_s);
  }
  ImGui::End();
}

}  // namespace filiform
