// The neighbourhood of the proxy, decoded: nodes with their incident segments as the solvers use them, kept from tick
// to tick, so that a warm tick touches no tile.
//
// A *star* is a node at its home tile: where it is, and of each incident segment, in the order of identity, the rank,
// the far end and which end is the child. What is in it follows from the tile's content alone, so it holds as long as
// the tile is resident: that is asked at each use. Nodes of more than kMostRays segments are not kept. Direct-mapped by
// identity, of fixed size. Thread rule: haptic thread only; every member but the constructor is noexcept, without
// allocation, lock or system call.
#pragma once

#include "solver/graph_view.h"

#include <array>
#include <cstdint>
#include <vector>

namespace filiform::internal {

class StarCache {
 public:
  static constexpr std::uint32_t kMostRays = 8;

  struct Ray {
    std::uint32_t segment;   // in the home tile
    std::uint32_t rank;      // of the segment, in the node's cell
    std::uint32_t far;       // in the home tile; the node itself: a loop to itself
    std::uint32_t far_rank;  // of the far end among its cell's samples
    bool from_child;         // the node is the segment's child
    Vector3d far_W;
  };
  struct Star {
    NodeId id{UINT32_MAX, UINT32_MAX};
    std::uint64_t epoch = 0;  // another than the cache's: empty
    const Tile* tile = nullptr;
    TileId home = kNoTile;
    std::uint32_t node = 0;  // in the home tile
    std::uint32_t degree = 0;
    bool plain = false;  // no segment of equal ends among them, no two with the same ends
    Vector3d p_W = Vector3d::Zero();
    std::array<Ray, kMostRays> rays;
  };

  // Rounded up to a power of two; 0.5 KB each.
  explicit StarCache(std::uint32_t stars);

  // Other tiles may have the ids of those seen so far: with another graph.
  void forget() noexcept { ++epoch_; }

  // The star of a node that `tile` stores; nullptr if its home is absent, or it has too many segments. Valid until a
  // star that shares its place is asked for. O(1) where it is kept.
  const Star* find(const GraphView& graph, NodeId id, const Tile& tile, std::uint32_t node) noexcept {
    Star& star = stars_[slotOf(id)];
    if (star.id == id && star.epoch == epoch_ && graph.tiles().find(star.home) == star.tile) return &star;
    return fill(graph, id, tile, node, star) ? &star : nullptr;
  }
  // They share a place: asking for one forgets the other. So do a node and itself.
  bool collide(NodeId a, NodeId b) const noexcept { return slotOf(a) == slotOf(b); }
  // It will be asked for soon: brings its place into the caches, from where a cold one would take the longest.
  void prefetch(NodeId id) const noexcept {
    const char* star = reinterpret_cast<const char*>(&stars_[slotOf(id)]);
    for (int line = 0; line < 3; ++line) __builtin_prefetch(star + 64 * line, 1);
  }
  // The same, only if it is kept.
  const Star* kept(const GraphView& graph, NodeId id) const noexcept {
    const Star& star = stars_[slotOf(id)];
    return star.id == id && star.epoch == epoch_ && graph.tiles().find(star.home) == star.tile ? &star : nullptr;
  }

 private:
  // Neighbouring samples lie side by side.
  std::size_t slotOf(NodeId id) const noexcept { return (id.sample + id.cell * 0x9e3779b9u) & mask_; }
  bool fill(const GraphView& graph, NodeId id, const Tile& tile, std::uint32_t node, Star& star) const noexcept;

  std::vector<Star> stars_;
  std::size_t mask_;
  std::uint64_t epoch_ = 1;
};

}  // namespace filiform::internal
