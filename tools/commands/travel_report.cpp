#include "tools/commands/travel_report.h"

#include "tools/drawing/report.h"
#include "viewer/scene/drawn_somata.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

namespace filiform::tools {

namespace {

std::string format(const char* pattern, double a, double b) {
  char text[160];
  std::snprintf(text, sizeof text, pattern, a, b);
  return text;
}

}  // namespace

void TravelReport::add(const TickRow& row) {
  time_s_.push_back(row.time_s);
  force_N_.push_back(row.force_N.norm());
  if (way_W_.empty() || way_W_.back() != row.p_W) way_W_.push_back(row.p_W);
  if (row.frontier && !at_frontier_) frontier_s_.push_back(row.time_s);
  at_frontier_ = row.frontier;
}

void TravelReport::writeForcePlot(const std::string& path, const std::string& title, const RunSummary& summary) const {
  Plot plot;
  plot.title = "Force at the hand: " + title;
  plot.subtitle = toString(summary.outcome) + format(", %.0f of %.0f um", summary.reached_um, summary.route_um) +
                  format(", mean %.2f N, integral %.2f N s", summary.mean_force_N, summary.force_integral_Ns);
  plot.x_label = "time (s)";
  plot.y_label = "force (N)";
  plot.series.push_back({"force", time_s_, force_N_});
  constexpr std::size_t kMostLines = 20;
  if (frontier_s_.size() <= kMostLines)
    for (const double at : frontier_s_) plot.lines.push_back({at, "frontier"});
  writePng(drawPlot(plot), path);
}

void TravelReport::writePicture(const std::string& path, const std::string& title, const RunSummary& summary,
                                const TileStore& store) const {
  GridBox bounds;
  for (std::uint32_t id = 0; id < store.cell_count(); ++id) bounds.extend(store.cell(id).bounds);
  ProjectionOptions options;
  options.title = title;
  options.subtitle =
      toString(summary.outcome) + format(": %.0f of %.0f um travelled", summary.reached_um, summary.route_um);
  options.lo_um = store.grid().toWorld(bounds.lo);
  options.hi_um = store.grid().toWorld(bounds.hi);
  for (int axis = 0; axis < 3; ++axis)  // a flat or single-point scene also needs a frame
    if (options.hi_um[axis] - options.lo_um[axis] < 1e-3) options.hi_um[axis] += 0.5, options.lo_um[axis] -= 0.5;
  const auto is_synthetic = [&](std::uint32_t id) {
    return store.cell(id).source.find("column/L") != std::string::npos;
  };
  if (store.cell_count() > 0 && is_synthetic(0) && is_synthetic(store.cell_count() - 1))
    options.levels = syntheticLevels();
  ProjectionPicture picture(options);
  RootTable somata;
  for (std::uint32_t cell = 0; cell < store.cell_count(); ++cell)
    for (const CellDetail::Root& root : store.loadCellDetail(cell).roots)
      if (root.type == kSomaType) somata.emplace(NodeId{cell, root.rank}, root);
  std::set<NodeId> drawn;  // roots of the somata already drawn
  SomaFinder finder(store);
  for (TileId id = 0; id < store.tile_count(); ++id) {
    const std::shared_ptr<const Tile> tile = store.load(id);
    const TileAppearance appearance = store.loadAppearance(id);
    finder.offer(tile, appearance);
    const SomaTable spheres = somataIn(*tile, appearance, somata, finder);
    std::size_t owned = 0;
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
      if (!tile->owned(s)) continue;
      const float radius_um = appearance.radii_um[owned];
      const std::uint16_t type = appearance.types[owned++];
      const NodeId parent = tile->nodeId(tile->parent(s));
      const Vector3d parent_W = tile->position_W(tile->parent(s));
      const auto sphere = spheres.find(parent);
      if (sphere != spheres.end()) {
        const Soma& soma = *sphere->second;
        if (drawn.insert({parent.cell, soma.root}).second) picture.addSoma(parent.cell, soma.centre_um, soma.radius_um);
        const auto child = spheres.find(tile->nodeId(tile->child(s)));
        if (child != spheres.end() && child->second == sphere->second) continue;
      } else if (const auto soma = somata.find(parent); soma != somata.end() && drawn.insert(parent).second) {
        picture.addSoma(parent.cell, parent_W, soma->second.radius_um);
      }
      picture.addSegment(parent.cell, tile->position_W(tile->child(s)), parent_W, type, radius_um);
    }
  }
  picture.addPath(way_W_);
  writePng(picture.finish(), path);
}

}  // namespace filiform::tools
