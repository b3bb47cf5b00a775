#include "index/cell/cell.h"
#include "index/cell/internal/spanning_forest.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace filiform {

void connect(Cell& cell, std::vector<std::array<std::uint32_t, 2>> edges) {
  const std::size_t n = cell.samples();
  SpanningForest forest = spanningForest(n, edges);
  const auto roots = std::count(forest.parents.begin(), forest.parents.end(), kNoParent);
  cell.links.clear();
  if (edges.size() + static_cast<std::size_t>(roots) == n) {
    cell.parents = std::move(forest.parents);
    return;
  }
  cell.parents.clear();
  std::vector<std::uint8_t> linked(n, 0);
  for (auto& [child, parent] : edges) {
    if (forest.turns[child] < forest.turns[parent]) std::swap(child, parent);
    linked[child] = linked[parent] = 1;
  }
  for (std::uint32_t node = 0; node < n; ++node)
    if (!linked[node]) edges.push_back({node, node});
  cell.links = std::move(edges);
}

}  // namespace filiform
