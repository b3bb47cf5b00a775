// A hierarchy over boxes in the order in which they are given: eight a node, without pointers. Consecutive boxes should
// lie close together, as tiles do in key order. Boxes are floats from an origin, rounded outward, so that bounds of
// distances are surely bounds. Thread rule: immutable after construction.
#pragma once

#include "index/tile/tile_engine.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace filiform::internal {

class BoxLevels {
 public:
  static constexpr std::uint32_t kWidth = 8;

  // A bound of a squared distance, um^2, and the child of a node that it is for. The bits of a float that is not
  // negative have its order; the last three bits are the child.
  class Bound {
   public:
    Bound() = default;
    Bound(float squared, std::uint32_t child) : bits_((std::bit_cast<std::uint32_t>(squared) & ~7u) | child) {}
    float squared() const { return std::bit_cast<float>(bits_ & ~7u); }
    std::uint32_t child() const { return bits_ & 7; }
    bool operator<(const Bound& other) const { return bits_ < other.bits_; }

   private:
    std::uint32_t bits_;
  };
  using Bounds = std::array<Bound, kWidth>;

  // Item ids are positions in `boxes`. Boxes may be flat or points. O(n).
  explicit BoxLevels(const std::vector<WorldBox>& boxes);

  std::uint32_t items() const { return levels_.empty() ? 0 : levels_[0].children; }

  // A place in the hierarchy: a node of a level, or an item at level -1.
  struct Place {
    std::int32_t level;
    std::uint32_t at;
  };
  // Requires items() > 0.
  Place root() const { return {static_cast<std::int32_t>(levels_.size()) - 1, 0}; }
  // Number of children of a node, and the i-th child.
  std::uint32_t children(Place node) const {
    const std::uint32_t left = levels_[static_cast<std::size_t>(node.level)].children - kWidth * node.at;
    return left < kWidth ? left : kWidth;
  }
  static Place child(Place node, std::uint32_t i) { return {node.level - 1, kWidth * node.at + i}; }

  // A point, widened by more than the rounding of WorldBox::squaredDistanceBelow().
  struct Probe {
    std::array<float, 3> lo, hi;
  };
  Probe probe(const Vector3d& h_W) const;
  // For each child of a node: at most what squaredDistanceBelow() returns for any box in it. Infinity where there is no
  // child. O(1).
  void squaredBelow(const Probe& probe, Place node, Bounds& squared) const;
  // A box around the i-th child of a node.
  WorldBox boxOf(Place node, std::uint32_t i) const;

  // Calls visit(item) for each item that may meet the region.
  template <class Visit>
  void meeting(const Region& region, Visit&& visit) const {
    if (levels_.empty()) return;
    std::array<Place, kWidth * 12> stack;  // enough for 8^11 items
    std::size_t depth = 0;
    stack[depth++] = root();
    while (depth > 0) {
      const Place node = stack[--depth];
      for (std::uint32_t i = 0; i < children(node); ++i) {
        if (!region.mayMeet(boxOf(node, i))) continue;
        const Place place = child(node, i);
        if (place.level < 0)
          visit(place.at);
        else
          stack[depth++] = place;
      }
    }
  }

 private:
  struct alignas(32) Node {
    std::array<std::array<float, kWidth>, 3> lo, hi;
  };
  struct Level {
    std::uint32_t begin, children;  // its first node; number of boxes in all its nodes
  };

  const Node& nodeAt(Place node) const { return nodes_[levels_[static_cast<std::size_t>(node.level)].begin + node.at]; }

  Vector3d origin_W_ = Vector3d::Zero();
  double size_um_ = 0;  // the largest coordinate of a box
  std::vector<Level> levels_;
  std::vector<Node> nodes_;
};

}  // namespace filiform::internal
