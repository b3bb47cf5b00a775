#include "index/measure/set_measures.h"

#include "index/query/cell_pass.h"
#include "index/workers.h"

#include <algorithm>

namespace filiform {
namespace {

CellMeasures measuresOfGraph(const CellGraph& graph, const MeasureOptions& options) {
  CellMeasures measures = measuresOf(treeOf(graph), options);
  for (MeasuredPart& part : measures.parts)
    if (part.rank != CellTree::kNone) part.sample_id = graph.sample_ids[part.rank];
  return measures;
}

}  // namespace

void measureCells(const TileStore& store, const std::vector<std::uint32_t>& cells, const SetMeasureOptions& options,
                  const std::function<void(std::uint32_t cell, const CellMeasures& measures)>& take) {
  constexpr std::size_t kCellsAThread = 8;
  const std::size_t group = kCellsAThread * std::max(options.threads, 1U);
  CellPass pass(
      store, cells,
      {.memory_bytes = options.memory_bytes, .threads = std::max(options.threads, 1U), .check = options.check});
  std::vector<CellGraph> graphs(group);
  std::vector<CellMeasures> found;
  for (std::size_t begin = 0; begin < cells.size(); begin += group) {
    if (options.check) options.check();
    const std::size_t count = std::min(group, cells.size() - begin);
    for (std::size_t i = 0; i < count; ++i) graphs[i] = pass.next();
    found.assign(count, {});
    runItems(count, options.threads, [&](std::size_t i) { found[i] = measuresOfGraph(graphs[i], options.measures); });
    for (std::size_t i = 0; i < count; ++i) take(cells[begin + i], found[i]);
  }
}

}  // namespace filiform
