#include "index/subsets/subset.h"

#include "index/cell/internal/spanning_forest.h"
#include "index/query/segment_pass.h"

#include <algorithm>
#include <utility>

namespace filiform {
namespace {

bool isAmong(std::uint16_t type, const std::vector<std::uint16_t>& types) {
  return std::find(types.begin(), types.end(), type) != types.end();
}

// Those of `cells` for which `found` holds.
std::vector<std::uint32_t> those(const std::vector<std::uint32_t>& cells, const std::vector<bool>& found) {
  std::vector<std::uint32_t> chosen;
  for (const std::uint32_t cell : cells)
    if (found[cell]) chosen.push_back(cell);
  return chosen;
}

template <class T>
void keepOnly(std::vector<T>& values, const std::vector<bool>& kept) {
  if (values.empty()) return;  // not read
  std::size_t to = 0;
  for (std::size_t i = 0; i < kept.size(); ++i)
    if (kept[i]) values[to++] = values[i];
  values.resize(to);
}

}  // namespace

std::vector<std::uint32_t> cellsInBox(const TileStore& store, const std::vector<std::uint32_t>& cells,
                                      const GridBox& box, const SubsetPass& pass) {
  std::vector<bool> found(store.cell_count());
  forEachSegment(store, {.box = box, .cells = cells, .threads = pass.threads, .check = pass.check},
                 [&](TileId, std::span<const PassedSegment> segments) {
                   for (const PassedSegment& s : segments) found[s.id.cell] = true;
                 });
  return those(cells, found);
}

std::vector<std::uint32_t> cellsWithTypes(const TileStore& store, const std::vector<std::uint32_t>& cells,
                                          const std::vector<std::uint16_t>& types, const SubsetPass& pass) {
  std::vector<bool> found(store.cell_count());
  forEachSegment(store, {.with_appearance = true, .cells = cells, .threads = pass.threads, .check = pass.check},
                 [&](TileId, std::span<const PassedSegment> segments) {
                   for (const PassedSegment& s : segments)
                     if (isAmong(s.type, types)) found[s.id.cell] = true;
                 });
  for (const std::uint32_t cell : cells)  // roots are the child of no segment
    if (!found[cell])
      for (const CellDetail::Root& root : store.loadCellDetail(cell).roots)
        if (isAmong(root.type, types)) found[cell] = true;
  return those(cells, found);
}

void keepTypes(CellGraph& cell, const std::vector<std::uint16_t>& types) {
  std::vector<bool> kept(cell.samples());
  std::vector<std::uint32_t> now(cell.samples() + 1);  // rank after the removal of a kept sample, or of the next one
  for (std::size_t i = 0; i < kept.size(); ++i) {
    kept[i] = isAmong(cell.types[i], types);
    now[i + 1] = now[i] + (kept[i] ? 1 : 0);
  }
  const std::uint32_t samples = now.back();
  std::vector<std::uint32_t> starts;
  for (const std::uint32_t start : cell.block_starts)
    if (now[start] > 0 && now[start] < samples && (starts.empty() || starts.back() != now[start]))
      starts.push_back(now[start]);
  cell.block_starts = std::move(starts);
  if (!cell.isGraph())
    for (std::uint32_t& parent : cell.parents) parent = parent != kNoParent && kept[parent] ? now[parent] : kNoParent;
  keepOnly(cell.parents, kept);
  keepOnly(cell.positions, kept);
  keepOnly(cell.sample_ids, kept);
  keepOnly(cell.radii_um, kept);
  keepOnly(cell.odd_radii_um, kept);
  keepOnly(cell.types, kept);
  cell.somata = {};
  if (!cell.isGraph()) return;
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (const auto& [child, parent] : cell.links)
    if (child != parent && kept[child] && kept[parent]) edges.push_back({now[child], now[parent]});
  Cell linked;
  linked.sample_ids = cell.sample_ids;
  connect(linked, std::move(edges));
  cell.links = std::move(linked.links);
  cell.parents = cell.isGraph() ? spanningForest(samples, cell.links).parents : std::move(linked.parents);
}

}  // namespace filiform
