#include "viewer/window/panels/panels.h"

#include "index/count_text.h"
#include "viewer/scene/minimap.h"
#include "viewer/window/panels/internal/attribute_panel.h"
#include "viewer/window/panels/internal/bookmark_panel.h"
#include "viewer/window/panels/internal/cell_panel.h"
#include "viewer/window/panels/internal/command_panel.h"
#include "viewer/window/panels/internal/contact_panel.h"
#include "viewer/window/panels/internal/help_panel.h"
#include "viewer/window/panels/internal/neurite_menu.h"
#include "viewer/window/panels/internal/panel_parts.h"
#include "viewer/window/panels/internal/tile_panel.h"
#include "viewer/window/settings/internal/text_format.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <imgui.h>
#include <string>
#include <vector>

namespace filiform {

namespace {

using internal::dim;
using internal::fitted;
using internal::format;
using internal::gold;
using internal::ground;
using internal::ink;
using internal::kPanelAlpha;
using internal::kStill;
using internal::lengthText;
using internal::red;
using internal::showFitted;
using internal::showWhole;
using internal::vec;
using internal::violet;
using internal::write;
using internal::writeIn;

// Above this error the picture is called coarse.
constexpr double kCoarse_px = 100;
constexpr double kForceWidth = 260, kStatusColumn = 82;  // times the scale

void drawStatus(const PanelData& d, bool beside_force) {
  ImGui::SetNextWindowPos(vec(10 * d.scale, 10 * d.scale));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  ImGui::Begin("status", nullptr, kStill | ImGuiWindowFlags_NoInputs);
  const double right = d.size.width - (beside_force ? (kForceWidth + 50) * d.scale : 10 * d.scale);
  const double width = std::max(80 * d.scale, right - 10 * d.scale - 2 * ImGui::GetStyle().WindowPadding.x);
  showFitted(d.status.scene, width, d.scale);
  const auto row = [&](const char* what, const std::string& value) {
    if (value.empty()) return;
    writeIn(dim(), what);
    ImGui::SameLine(static_cast<float>(kStatusColumn * d.scale));
    showFitted(value, width - (kStatusColumn - 8) * d.scale, d.scale);
  };
  row("cell", d.status.cell);
  row("neurite", d.status.neurite);
  row("place", d.status.place);
  row("hand", d.force.shown                    ? d.status.device + ", " + d.status.mode
              : d.status.mode == "constrained" ? std::string()
                                               : d.status.mode);
  row("zoom", lengthText(d.map.zoom_um) + " across");
  if (d.force.shown) row("force", format("%.2f N", d.force.now_N));
  row("measure", d.status.measure);
  std::string drawn = counted(d.status.segments, "segment");
  if (d.status.error_px > kCoarse_px)
    drawn += ", coarse";
  else if (d.status.error_px > 0)
    drawn += format(", error %.1f px", d.status.error_px);
  row("drawn", drawn);
  row("left out", d.status.left_out > 0 ? counted(d.status.left_out, "segment") : std::string());
  row("measures", d.status.measuring);
  row("loading", d.status.pending > 0 ? counted(d.status.pending, "tile") : std::string());
  row("missing", d.status.unreadable > 0 ? counted(d.status.unreadable, "tile") : std::string());
  row("stereo", d.status.stereo);
  if (d.status.frozen) writeIn(gold(), "levels of detail are frozen (l)");
  ImGui::End();
}

// The room for lines over the picture: from left to right, pixels.
struct Lines {
  double left, right;
};

// Writes lines above `bottom`, on a ground, wrapped to the room; moves `bottom` above it.
void drawLine(ImDrawList& list, const Lines& room, double scale, ImU32 colour, const std::string& text,
              double& bottom) {
  const double widest = std::max(60.0, std::min(room.right - room.left, 760 * scale)), rim = 4 * scale;
  const ImVec2 taken = ImGui::CalcTextSize(text.c_str(), nullptr, false, static_cast<float>(widest));
  const double left = (room.left + room.right - taken.x) / 2.0, top = bottom - taken.y - 2 * rim;
  list.AddRectFilled(vec(left - 2 * rim, top), vec(left + taken.x + 2 * rim, bottom), ground(215),
                     static_cast<float>(rim));
  list.AddText(ImGui::GetFont(), ImGui::GetFontSize(), vec(left, top + rim), colour, text.c_str(), nullptr,
               static_cast<float>(widest));
  bottom = top - rim / 2;
}

void drawMessages(const PictureSize& size, double scale, const Lines& room, const TextLines& lines) {
  // Over the picture, and below the panels.
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  double bottom = size.height - 8 * scale;
  if (!lines.hint.empty()) drawLine(list, room, scale, dim(), lines.hint, bottom);
  if (!lines.network.empty()) drawLine(list, room, scale, red(), lines.network, bottom);
  for (std::size_t i = lines.messages.size(); i-- > 0;) drawLine(list, room, scale, gold(), lines.messages[i], bottom);
}

// A bar of round length, in the corner without panels.
void drawScaleBar(const PanelData& d) {
  if (!(d.um_px > 0) || !std::isfinite(d.um_px) || d.size.width < 100 * d.scale) return;
  const ScaleBar bar = scaleBar(d.um_px, std::min(220 * d.scale, d.size.width / 4.0));
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const double right = d.size.width - 20 * d.scale, left = right - bar.length_px, y = d.size.height - 22 * d.scale;
  const auto thick = static_cast<float>(2 * d.scale);
  list.AddLine(vec(left, y), vec(right, y), ink(), thick);
  list.AddLine(vec(left, y - 5 * d.scale), vec(left, y + 5 * d.scale), ink(), thick);
  list.AddLine(vec(right, y - 5 * d.scale), vec(right, y + 5 * d.scale), ink(), thick);
  const std::string text = lengthText(bar.length_um);
  const ImVec2 size = ImGui::CalcTextSize(text.c_str());
  write(list, vec((left + right - size.x) / 2, y - 8 * d.scale - size.y), ink(), text);
}

// In the overview a proxy is too small to be seen: a ring and a word show its place.
void drawRing(const PanelData& d, const ScreenPoint& place, ImU32 colour, const std::string& word) {
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const auto radius = static_cast<float>(11 * d.scale), thick = static_cast<float>(2 * d.scale);
  const ImVec2 at = vec(place.x, place.y);
  list.AddCircle(at, radius, ground(200), 32, 2 * thick);
  list.AddCircle(at, radius, colour, 32, thick);
  write(list, vec(at.x + 15 * d.scale, at.y - 7 * d.scale), colour, word);
}

bool isAhead(const std::optional<ScreenPoint>& place) { return place && place->depth_um > 0; }

void drawHere(const PanelData& d) {
  if (d.hand.overview && isAhead(d.hand.proxy)) drawRing(d, *d.hand.proxy, gold(), "proxy");
}

// The line from a proxy to its hand.
void drawLineOfPull(const PanelData& d, const ScreenPoint& proxy, const ScreenPoint& hand, double force_N) {
  if (std::hypot(hand.x - proxy.x, hand.y - proxy.y) < 4 * d.scale) return;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const double part = std::clamp(force_N / 4, 0.0, 1.0);
  const ImU32 colour = IM_COL32(static_cast<int>(120 + 135 * part), static_cast<int>(220 - 120 * part), 110, 255);
  const auto thick = static_cast<float>((1.5 + 3 * part) * d.scale);
  list.AddLine(vec(proxy.x, proxy.y), vec(hand.x, hand.y), colour, thick);
  list.AddCircle(vec(hand.x, hand.y), static_cast<float>(6 * d.scale), colour, 24, thick);
  write(list, vec(hand.x + 10 * d.scale, hand.y - 6 * d.scale), ink(), format("%.2f N", force_N));
}

void drawPull(const PanelData& d) {
  if (isAhead(d.hand.proxy) && isAhead(d.hand.hand)) drawLineOfPull(d, *d.hand.proxy, *d.hand.hand, d.force.now_N);
}

void drawCompanion(const PanelData& d) {
  if (!isAhead(d.companion.proxy)) return;
  drawRing(d, *d.companion.proxy, violet(), d.companion.name);
  if (!d.hand.overview && isAhead(d.companion.hand))
    drawLineOfPull(d, *d.companion.proxy, *d.companion.hand, d.companion.force_N);
}

void drawForce(const PanelData& d) {
  const double width = kForceWidth * d.scale, height = 90 * d.scale;
  ImGui::SetNextWindowPos(vec(d.size.width - 10 * d.scale, 10 * d.scale), ImGuiCond_Always, vec(1, 0));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  ImGui::Begin("force", nullptr, kStill | ImGuiWindowFlags_NoInputs);
  ImGui::Text("force %.2f N, last 4 s", d.force.now_N);
  const ImVec2 at = ImGui::GetCursorScreenPos();
  ImGui::Dummy(vec(width, height));
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const std::vector<float>& forces = *d.force.last_N;
  double top = 0.5;
  for (const float force : forces) top = std::max(top, static_cast<double>(force));
  top = top <= 1 ? 1 : top <= 2 ? 2 : top <= 4 ? 4 : 8;
  for (int line = 0; line <= 2; ++line) {
    const double y = at.y + height * (1 - line / 2.0);
    list.AddLine(vec(at.x, y), vec(at.x + width, y), IM_COL32(90, 98, 115, 140));
  }
  list.AddText(vec(at.x, at.y), dim(), format("%g N", top).c_str());
  list.AddText(vec(at.x, at.y + height / 2), dim(), format("%g", top / 2).c_str());
  list.AddText(vec(at.x, at.y + height - ImGui::GetTextLineHeight()), dim(), "0");
  // The largest force of each pixel's ticks, so that no peak is lost.
  constexpr std::size_t kTicks = 4000;
  const auto columns = static_cast<std::size_t>(width);
  ImVec2 last{};
  for (std::size_t column = 0; column < columns; ++column) {
    const std::size_t begin = column * kTicks / columns, end = (column + 1) * kTicks / columns;
    float most = 0;
    for (std::size_t back = kTicks - end; back < kTicks - begin && back < forces.size(); ++back)
      most = std::max(most, forces[forces.size() - 1 - back]);
    const ImVec2 point = vec(at.x + static_cast<double>(column), at.y + height * (1 - std::min(1.0, most / top)));
    if (column > 0) list.AddLine(last, point, gold(), static_cast<float>(1.3 * d.scale));
    last = point;
  }
  ImGui::End();
}

void drawPicture(const PanelData& d, PanelRequests& requests) {
  if (d.picture.text.empty()) return;
  ImGui::SetNextWindowPos(vec(d.size.width - 10 * d.scale, d.size.height - 60 * d.scale), ImGuiCond_Always, vec(1, 1));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  ImGui::Begin("picture", nullptr, kStill);
  ImGui::TextUnformatted(d.picture.text.c_str());
  if (d.picture.part >= 0) {
    ImGui::ProgressBar(static_cast<float>(d.picture.part), vec(220 * d.scale, 0));
    requests.cancel_picture = ImGui::Button("cancel (Esc)");
  }
  ImGui::End();
}

void drawMap(const PanelData& d, ImDrawList& list, const Minimap& map, const ImVec2& at, bool whole) {
  const auto place = [&](double x, double y) { return vec(at.x + x, at.y + y); };
  const Minimap::Box all = map.box(d.map.lo_W, d.map.hi_W);
  list.AddRect(place(all.left, all.top), place(all.right, all.bottom), IM_COL32(120, 135, 160, 255));
  if (whole && d.map.visited_W.size() > 1)
    for (std::size_t i = 1; i < d.map.visited_W.size(); ++i)
      list.AddLine(place(map.x(d.map.visited_W[i - 1]), map.y(d.map.visited_W[i - 1])),
                   place(map.x(d.map.visited_W[i]), map.y(d.map.visited_W[i])), IM_COL32(235, 200, 90, 70));
  if (whole) {
    const Minimap::Box nested = map.box(d.map.centre_W, 10 * d.map.zoom_um, 0);
    list.AddRect(place(nested.left, nested.top), place(nested.right, nested.bottom), IM_COL32(120, 135, 160, 150));
  }
  const Minimap::Box space = map.box(d.map.centre_W, d.map.zoom_um, 5 * d.scale);
  list.AddRect(place(space.left, space.top), place(space.right, space.bottom), gold());
  for (std::size_t i = 0; i < d.map.bookmarks_W.size(); ++i) {
    const ImVec2 dot = place(map.x(d.map.bookmarks_W[i]), map.y(d.map.bookmarks_W[i]));
    list.AddCircleFilled(dot, static_cast<float>(2.5 * d.scale), IM_COL32(110, 190, 255, 255));
    list.AddText(vec(dot.x + 3 * d.scale, dot.y - 6 * d.scale), IM_COL32(110, 190, 255, 255),
                 d.map.bookmark_names[i].c_str());
  }
  list.AddCircleFilled(place(map.x(d.map.proxy_W), map.y(d.map.proxy_W)), static_cast<float>(2.5 * d.scale), ink());
}

// Returns the place that the user clicked. Sets `right` to the panel's right edge, pixels.
std::optional<Vector3d> drawMinimap(const PanelData& d, double& right) {
  const double side = 170 * d.scale;
  if (d.size.width < 2.5 * side || d.size.height < 3.5 * side) return std::nullopt;
  ImGui::SetNextWindowPos(vec(10 * d.scale, d.size.height - 10 * d.scale), ImGuiCond_Always, vec(0, 1));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  ImGui::Begin("minimap", nullptr, kStill);
  std::optional<Vector3d> clicked;
  const Minimap whole(d.map.lo_W, d.map.hi_W, side, side);
  const Minimap near = whole.around(d.map.centre_W, d.map.zoom_um, side / 2, side / 2);
  ImDrawList& list = *ImGui::GetWindowDrawList();
  writeIn(dim(), "whole scene, front view");
  const auto map = [&](const char* name, const Minimap& shown, double across, bool all) {
    const ImVec2 at = ImGui::GetCursorScreenPos();
    if (ImGui::InvisibleButton(name, vec(across, across))) {
      const ImVec2 mouse = ImGui::GetIO().MousePos;
      clicked = shown.toWorld(mouse.x - at.x, mouse.y - at.y, d.map.proxy_W.z());
    }
    list.PushClipRect(at, vec(at.x + across, at.y + across), true);
    list.AddRectFilled(at, vec(at.x + across, at.y + across), IM_COL32(0, 0, 0, 60));
    drawMap(d, list, shown, at, all);
    list.PopClipRect();
  };
  map("whole", whole, side, true);
  if (d.map.zoom_um * 10 < 0.7 * (d.map.hi_W - d.map.lo_W).head<2>().maxCoeff()) {
    ImGui::SameLine();
    map("near", near, side / 2, false);
  }
  right = ImGui::GetWindowPos().x + ImGui::GetWindowSize().x;
  ImGui::End();
  return clicked;
}

void drawSearch(const PanelData& d, bool& open, SearchPanel& search, PanelRequests& requests) {
  ImGui::SetNextWindowPos(vec(d.size.width / 2.0, d.size.height * 0.15), ImGuiCond_Always, vec(0.5, 0));
  ImGui::SetNextWindowSize(vec(std::min(520 * d.scale, d.size.width * 0.9), 0));
  ImGui::Begin("go to", &open,
               ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoResize);
  writeIn(dim(),
          d.colours.attributes.empty()
              ? "type a part of a cell's name, CELL:soma, CELL:ID, or X Y Z in \u00b5m; then Enter"
              : "type a part of a cell's name, CELL:soma, CELL:ID, X Y Z in \u00b5m, or ATTRIBUTE=VALUE; then Enter");
  if (search.focus) ImGui::SetKeyboardFocusHere();
  search.focus = false;
  std::array<char, 1024> text{};
  search.text.copy(text.data(), text.size() - 1);
  ImGui::SetNextItemWidth(-1);
  const bool entered = ImGui::InputText("##query", text.data(), text.size(), ImGuiInputTextFlags_EnterReturnsTrue);
  if (search.text != text.data()) {
    search.text = text.data();
    search.error.clear();
    search.chosen = -1;
    requests.search_changed = true;
  }
  const int names = static_cast<int>(search.names.size());
  const auto pressed = [](ImGuiKey key) { return ImGui::IsKeyPressed(ImGui::GetKeyIndex(key)); };
  if (ImGui::IsItemActive() && pressed(ImGuiKey_DownArrow)) ++search.chosen;
  if (ImGui::IsItemActive() && pressed(ImGuiKey_UpArrow)) --search.chosen;
  search.chosen = std::clamp(search.chosen, -1, names - 1);
  if (entered) requests.go = search.chosen < 0 ? search.text : search.names[static_cast<std::size_t>(search.chosen)];
  for (std::size_t i = 0; i < search.names.size(); ++i) {
    // Draw the name as text: Dear ImGui does not show what follows "##" in a label.
    const std::string& name = search.names[i];
    ImGui::PushID(static_cast<int>(i));
    const ImVec2 at = ImGui::GetCursorScreenPos();
    const std::string shown = fitted(name, ImGui::GetContentRegionAvail().x);
    if (ImGui::Selectable("##name", static_cast<int>(i) == search.chosen)) requests.go = name;
    if (shown.size() != name.size() && ImGui::IsItemHovered()) showWhole(name, d.scale);
    ImGui::GetWindowDrawList()->AddText(at, ImGui::GetColorU32(ImGuiCol_Text), shown.c_str());
    ImGui::PopID();
  }
  ImGui::PushTextWrapPos(0);
  if (!search.error.empty()) writeIn(red(), search.error);
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
  choose("theme", settings.theme, kThemes);
  choose("stereo", settings.stereo, kStereoModes);
  const auto slide = [&](const char* what, double& value, float least, float most) {
    auto shown = static_cast<float>(value);
    if (!ImGui::SliderFloat(what, &shown, least, most, "%.2f")) return;
    value = std::clamp(shown, least, most);
    requests.settings_changed = true;
  };
  slide("eye separation", settings.separation, 0, 2);
  slide("field of view", settings.widening, 0.5F, 2);
  slide("text size", settings.interface_scale, 0.5F, 4);
  requests.settings_changed |= ImGui::Checkbox("orthographic view", &settings.orthographic);
  requests.settings_changed |= ImGui::Checkbox("dim the other cells", &settings.own_cell);
  requests.settings_changed |= ImGui::Checkbox("orange and blue fork", &settings.orange_blue);
  requests.settings_changed |= ImGui::Checkbox("reduced motion", &settings.reduced_motion);
  if (ImGui::Button("reset to defaults")) requests.reset = true;
  ImGui::End();
}

void drawTooltip(const PanelData& d) {
  if (d.tooltip.text.empty()) return;
  ImDrawList& list = *ImGui::GetForegroundDrawList();
  const auto widest = static_cast<float>(std::max(60.0, std::min(d.size.width - 24 * d.scale, 600 * d.scale)));
  const ImVec2 size = ImGui::CalcTextSize(d.tooltip.text.c_str(), nullptr, false, widest);
  const double x = std::min(d.tooltip.x + 14 * d.scale, d.size.width - size.x - 12 * d.scale);
  const double y = std::min(d.tooltip.y + 16 * d.scale, d.size.height - size.y - 12 * d.scale);
  list.AddRectFilled(vec(x - 6 * d.scale, y - 4 * d.scale), vec(x + size.x + 6 * d.scale, y + size.y + 4 * d.scale),
                     ground(235), static_cast<float>(4 * d.scale));
  list.AddText(ImGui::GetFont(), ImGui::GetFontSize(), vec(x, y), ink(), d.tooltip.text.c_str(), nullptr, widest);
}

}  // namespace

PanelRequests drawPanels(const PanelData& d, const TilePanel& tiles, OpenPanels& open, SearchPanel& search,
                         Settings& settings) {
  PanelRequests requests;
  drawHere(d);
  drawPull(d);
  drawCompanion(d);
  drawScaleBar(d);
  Lines room{0, d.size.width - std::min(220 * d.scale, d.size.width / 4.0) - 20 * d.scale};  // left of the scale bar
  const bool has_force = d.force.shown && d.force.last_N != nullptr && d.size.width >= 420 * d.scale;
  if (d.size.width >= 240 * d.scale && d.size.height >= 200 * d.scale) drawStatus(d, has_force);
  if (has_force) drawForce(d);
  drawPicture(d, requests);
  if (settings.show_minimap) requests.go_to_W = drawMinimap(d, room.left);
  if (settings.show_tiles) internal::drawTiles(d, tiles);
  internal::drawAttributes(d, requests);
  if (open.cells.open && d.cells.table != nullptr) internal::drawCells(d, open.cells, requests);
  if (open.contacts.open && d.contacts != nullptr) internal::drawContacts(d, open.contacts, requests);
  if (open.bookmarks.open) internal::drawBookmarks(d, open.bookmarks, requests);
  if (open.settings) drawSettings(d, open.settings, settings, requests);
  if (open.help) internal::drawHelp(d, open.help);
  if (open.menu.open) internal::drawNeuriteMenu(d, open.menu, requests);
  // Last: a window that appears takes the keyboard from those before.
  if (open.commands.open) internal::drawCommands(d, open.commands, requests);
  if (open.search) drawSearch(d, open.search, search, requests);
  // Centred in the window, if minimap and scale bar leave enough room.
  room.left = std::max(room.left, d.size.width - room.right) + 20 * d.scale;
  if (room.right - room.left < 240 * d.scale) room = {20 * d.scale, d.size.width - 20 * d.scale};
  TextLines lines = d.lines;
  if (open.help) lines.hint.clear();
  drawMessages(d.size, d.scale, room, lines);
  drawTooltip(d);
  return requests;
}

void drawOpening(const PictureSize& size, double scale, const std::string& what, double since_s,
                 const std::vector<std::string>& messages) {
  drawMessages(size, scale, {20 * scale, size.width - 20 * scale}, {messages, {}, {}});
  ImGui::SetNextWindowPos(vec(size.width / 2.0, size.height / 2.0), ImGuiCond_Always, vec(0.5, 0.5));
  ImGui::Begin("opening", nullptr, kStill);
  showFitted(what, size.width - 40 * scale, scale);
  if (since_s >= 0) {
    // The amount of work is unknown: the bar restarts each second.
    ImGui::ProgressBar(static_cast<float>(since_s - std::floor(since_s)), vec(320 * scale, 8 * scale), "");
    ImGui::Text("%.0f s", since_s);
  }
  ImGui::End();
}

}  // namespace filiform
