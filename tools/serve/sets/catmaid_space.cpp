#include "tools/serve/sets/catmaid_space.h"

#include "index/set/tile_set.h"
#include "tools/words/refusal.h"

#include <algorithm>
#include <map>

namespace filiform::tools {

namespace {

constexpr std::uint64_t kMostNode = INT32_MAX;
constexpr std::int64_t kLeastEdge = 128;     // quanta: whole nm for every quantum
constexpr double kMostEdge_nm = 4294967295;  // clients hold an edge as uint32

// The least power of two that is not smaller.
std::int64_t powerOfTwo(std::int64_t quanta) {
  std::int64_t edge = kLeastEdge;
  while (edge < quanta) edge *= 2;
  return edge;
}

}  // namespace

CatmaidSpace::CatmaidSpace(const TileSet& set, const Levels* levels, const std::function<void()>& check)
    : set_(set), quantum_nm_(set.grid().quantum_um() * 1e3) {
  const auto take = [](std::uint64_t& next, std::uint64_t nodes) {
    checkNodes(next - 1, nodes);
    const std::uint64_t first = next;
    next += nodes;
    return static_cast<std::uint32_t>(first);
  };
  std::uint64_t next = 1;
  for (std::uint32_t cell = 0; cell < set.cell_count(); ++cell) {
    if (check && cell % 256 == 0) check();
    first_nodes_.push_back(take(next, set.cell(cell).samples));
  }
  // A segment brings at most two nodes.
  for (LevelId level = 0; levels != nullptr && level < levels->size(); ++level)
    first_level_nodes_.push_back(take(next, std::uint64_t{2} * levels->entry(level).segments));
  addLevels(levels);
}

void CatmaidSpace::checkNodes(std::uint64_t nodes, std::uint64_t more) {
  if (more > kMostNode - nodes)
    throw Refusal(413, "the set has more nodes than CATMAID's 32-bit ids can name; use the address under /precomputed");
}

void CatmaidSpace::addLevels(const Levels* levels) {
  std::int64_t extent = 1;
  if (!set_.bounds().empty()) extent = (set_.bounds().hi - set_.bounds().lo).maxCoeff() + 1;
  std::int64_t whole = powerOfTwo(extent);
  while (static_cast<double>(whole) * quantum_nm_ > kMostEdge_nm) whole /= 2;

  std::map<int, std::uint32_t> most_segments;  // by depth
  for (LevelId level = 0; levels != nullptr && level < levels->size(); ++level) {
    std::uint32_t& most = most_segments[levels->entry(level).key.depth / 3 * 3];
    most = std::max(most, levels->entry(level).segments);
  }
  const std::uint64_t capacity = set_.capacity();
  for (const auto& [depth, most] : most_segments) {
    const std::int64_t block = std::int64_t{1} << (kMortonAxisBits - depth / 3);
    const Level level{depth, std::clamp(block, kLeastEdge, whole), 2 * std::max<std::uint64_t>(most, capacity)};
    // Of the blocks that are larger than the data, the finest is enough.
    if (!levels_.empty() && levels_.back().edge == level.edge) levels_.pop_back();
    levels_.push_back(level);
  }
  std::int64_t finest = whole;
  if (!levels_.empty()) {
    finest = std::max(kLeastEdge, levels_.back().edge / 2);
  } else {
    constexpr std::uint64_t kTiles = 8;  // in a cube, about
    for (std::uint64_t tiles = set_.counts().tiles; tiles > kTiles && finest > kLeastEdge; tiles /= 8) finest /= 2;
  }
  levels_.push_back({kFull, finest, 16 * capacity});
}

std::optional<std::uint32_t> CatmaidSpace::cellOf(std::uint64_t skeleton) const {
  if (skeleton == 0 || skeleton > set_.cell_count()) return std::nullopt;
  const auto cell = static_cast<std::uint32_t>(skeleton - 1);
  return set_.cell(cell).removed ? std::nullopt : std::optional(cell);
}

}  // namespace filiform::tools
