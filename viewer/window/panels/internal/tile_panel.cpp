#include "viewer/window/panels/internal/tile_panel.h"

#include "index/count_text.h"
#include "viewer/scene/minimap.h"
#include "viewer/window/panels/internal/panel_parts.h"
#include "viewer/window/settings/internal/text_format.h"

#include <algorithm>
#include <string>

namespace filiform::internal {

namespace {

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

// States, memory and read rates.
void showTileCounts(const TilePanel& t, double scale) {
  if (t.in_memory) {
    ImGui::Text("in memory: all of %s", counted(t.tiles, "tile").c_str());
    return;
  }
  const ResidencyCounters& c = t.counters;
  const auto row = [&](const char* what, const std::string& value) {
    ImGui::TextUnformatted(what);
    ImGui::SameLine(static_cast<float>(100 * scale));
    ImGui::TextUnformatted(value.c_str());
  };
  ImGui::Text("%s; those of the hand:", counted(t.tiles, "tile").c_str());
  for (int i = 0; i < 7; ++i) {
    const auto state = static_cast<TileState>(i);
    if (t.counts[i] == 0 && state != TileState::resident) continue;
    ImGui::ColorButton(toString(state), ImColor(colourOf(state)), ImGuiColorEditFlags_NoTooltip,
                       vec(10 * scale, 10 * scale));
    ImGui::SameLine();
    row(toString(state), formatCount(t.counts[i]));
  }
  std::string budget = bytesText(static_cast<double>(c.bytes));
  budget += t.budget_bytes == UINT64_MAX ? " (no limit)" : " of " + bytesText(static_cast<double>(t.budget_bytes));
  row("memory", budget);
  if (t.budget_bytes != UINT64_MAX)
    ImGui::ProgressBar(static_cast<float>(static_cast<double>(c.bytes) / static_cast<double>(t.budget_bytes)),
                       vec(240 * scale, 6 * scale), "");
  row("read",
      format("%s, %.0f per s, %s/s", counted(c.reads, "tile").c_str(), t.reads_s, bytesText(t.read_bytes_s).c_str()));
  row("evicted", counted(c.evictions, "tile"));
  row("waited", counted(t.frontiers, "tick") + " for tiles");
  ImGui::PushTextWrapPos(static_cast<float>(360 * scale));
  for (const std::string& failure : t.failures) writeIn(red(), failure);
  ImGui::PopTextWrapPos();
}

// The boxes of the tiles nearest to the proxy.
void showTileMap(const PanelData& d, const TilePanel& t) {
  if (t.boxes.empty()) return;
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
  list.AddCircleFilled(vec(at.x + map.x(d.map.proxy_W), at.y + map.y(d.map.proxy_W)), static_cast<float>(3 * d.scale),
                       ink());
  ImGui::PushTextWrapPos(static_cast<float>(side));
  writeIn(dim(), counted(t.boxes.size(), "tile") + " nearest to the proxy, front view");
  ImGui::PopTextWrapPos();
}

}  // namespace

void drawTiles(const PanelData& d, const TilePanel& t) {
  ImGui::SetNextWindowPos(vec(d.size.width - 10 * d.scale, 150 * d.scale), ImGuiCond_FirstUseEver, vec(1, 0));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  ImGui::Begin("tiles and memory", nullptr,
               ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav);
  // The panel grows with its content: keep it inside the window.
  const ImVec2 at_first = ImGui::GetWindowPos(), taken = ImGui::GetWindowSize();
  const double inside = d.size.width - 10 * d.scale - taken.x;
  if (at_first.x > inside) ImGui::SetWindowPos(vec(std::max(0.0, inside), at_first.y));
  showTileCounts(t, d.scale);
  showTileMap(d, t);
  ImGui::End();
}

}  // namespace filiform::internal
