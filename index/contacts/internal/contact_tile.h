// ContactTile: the segments that a tile owns, as the search for contacts needs them, and where else to look.
#pragma once

#include "index/contacts/closest_places.h"
#include "index/tile/tile_engine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace filiform::internal {

enum ContactSides : std::uint8_t { kFromSide = 1, kToSide = 2 };

// A box in float that holds what it is made of: rounded outward. Thread rule: a value.
struct RoundedBox {
  std::array<float, 3> lo{HUGE_VALF, HUGE_VALF, HUGE_VALF}, hi{-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};

  RoundedBox() = default;
  RoundedBox(const WorldBox& box, double more_um);
  void extend(const RoundedBox& other) {
    for (std::size_t i = 0; i < 3; ++i) {
      lo[i] = other.lo[i] < lo[i] ? other.lo[i] : lo[i];
      hi[i] = other.hi[i] > hi[i] ? other.hi[i] : hi[i];
    }
  }
  bool meets(const RoundedBox& other) const {
    return lo[0] <= other.hi[0] && hi[0] >= other.lo[0] && lo[1] <= other.hi[1] && hi[1] >= other.lo[1] &&
           lo[2] <= other.hi[2] && hi[2] >= other.lo[2];
  }
};

// Boxes of things in a row: of each, of each eight, and of each 64. Neighbours in the row lie close together.
struct BoxRow {
  static constexpr std::size_t kFew = 8;
  std::array<std::vector<RoundedBox>, 3> levels;

  void add(const RoundedBox& box) { levels[0].push_back(box); }
  void finish();  // makes the levels above
  std::size_t size() const { return levels[0].size(); }
  std::uint64_t bytes() const;
};

// Calls visit(i, j) for all i of `a` and j of `b` whose boxes meet. O(pairs of 64 and 64, and what of them meets).
template <class Visit>
void forEachMeeting(const BoxRow& a, const BoxRow& b, const Visit& visit);

struct ContactSegment {
  SegmentEnds ends;  // radii: 0 unless surfaces are wanted
  double length_um;
  std::uint32_t cell, segment, child, parent;
  std::uint16_t type;
  std::uint8_t sides;  // ContactSides; not 0
  bool radius_is_unknown;
  WorldBox box() const;  // with the radii
};

// Thread rule: immutable once made.
struct ContactTile {
  std::vector<ContactSegment> segments;  // of the wanted cells and types, in the order of the tile's runs
  BoxRow boxes;                          // of the segments
  // Tiles that own segments which this tile stores without owning them, each with a box around these, without radii.
  struct Owner {
    TileId tile;
    WorldBox box;
  };
  std::vector<Owner> owners;

  std::uint64_t bytes() const;
};

template <class Visit>
void forEachMeeting(const BoxRow& a, const BoxRow& b, const Visit& visit) {
  const auto each = [](const std::vector<RoundedBox>& boxes, std::size_t above, const RoundedBox& other,
                       const auto& then) {
    const std::size_t end = std::min(boxes.size(), (above + 1) * BoxRow::kFew);
    for (std::size_t i = above * BoxRow::kFew; i < end; ++i)
      if (boxes[i].meets(other)) then(i);
  };
  for (std::size_t a2 = 0; a2 < a.levels[2].size(); ++a2)
    for (std::size_t b2 = 0; b2 < b.levels[2].size(); ++b2) {
      if (!a.levels[2][a2].meets(b.levels[2][b2])) continue;
      each(a.levels[1], a2, b.levels[2][b2], [&](std::size_t a1) {
        each(b.levels[1], b2, a.levels[1][a1], [&](std::size_t b1) {
          each(a.levels[0], a1, b.levels[1][b1],
               [&](std::size_t a0) { each(b.levels[0], b1, a.levels[0][a0], [&](std::size_t b0) { visit(a0, b0); }); });
        });
      });
    }
}

}  // namespace filiform::internal
