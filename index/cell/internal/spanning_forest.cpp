#include "index/cell/internal/spanning_forest.h"

#include <utility>

namespace filiform {

SpanningForest spanningForest(std::size_t samples, const std::vector<std::array<std::uint32_t, 2>>& edges) {
  std::vector<std::uint64_t> begin(samples + 1, 0);
  for (const auto& [a, b] : edges) ++begin[a], ++begin[b];
  for (std::uint64_t sum = 0; std::uint64_t & at : begin) at = std::exchange(sum, sum + at);
  std::vector<std::uint32_t> incident(2 * edges.size());
  {
    std::vector<std::uint64_t> next(begin.begin(), begin.end() - 1);
    for (std::uint32_t e = 0; e < edges.size(); ++e)
      for (const std::uint32_t end : edges[e]) incident[next[end]++] = e;
  }
  SpanningForest forest{std::vector<std::uint32_t>(samples, kNoParent), std::vector<std::uint32_t>(samples, 0)};
  std::uint32_t turn = 0;
  std::vector<std::uint32_t> queue;
  for (std::uint32_t root = 0; root < samples; ++root) {
    if (forest.turns[root] != 0) continue;
    forest.turns[root] = ++turn;
    queue.assign(1, root);
    for (std::size_t at = 0; at < queue.size(); ++at) {
      const std::uint32_t node = queue[at];
      for (std::uint64_t i = begin[node]; i < begin[node + 1]; ++i) {
        const auto& [a, b] = edges[incident[i]];
        const std::uint32_t other = a == node ? b : a;
        if (forest.turns[other] != 0) continue;
        forest.turns[other] = ++turn;
        forest.parents[other] = node;
        queue.push_back(other);
      }
    }
  }
  return forest;
}

}  // namespace filiform
