// ContactTile: the segments that a tile owns, as the search for contacts needs them, and where else to look.
#pragma once

#include "index/contacts/closest_places.h"
#include "index/contacts/internal/segment_row.h"
#include "index/tile/tile_engine.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace filiform::internal {

enum ContactSide : std::size_t { kFromSide, kToSide };

// Thread rule: immutable once made.
class ContactTile {
 public:
  ContactTile(std::shared_ptr<const Tile> of) : tile(std::move(of)), origin_W(tile->grid().toWorld(tile->origin())) {}

  // The wanted segments of one side, in the order of the tile's runs.
  struct Side {
    struct Item {
      std::uint32_t segment, child, parent;  // of the tile
      std::uint16_t type;
    };
    SegmentRow row;
    std::vector<Item> items;
    std::vector<std::array<float, 2>> radii_um;  // of child and parent; only if surfaces are wanted
  };
  std::shared_ptr<const Tile> tile;
  Vector3d origin_W;          // of the tile
  std::array<Side, 2> sides;  // by ContactSide; only the first if both are alike
  // Tiles that own segments which this tile stores without owning them, each with a box around these, without radii.
  struct Owner {
    TileId tile;
    WorldBox box;
  };
  std::vector<Owner> owners;

  // With the counted radii: 0 unless surfaces are wanted.
  SegmentEnds ends(const Side& side, std::uint32_t i) const;
  std::uint64_t bytes() const;

 private:
  Vector3d position_W(std::uint32_t node) const;
};

// The radius that surfaces count with; 0 for an unknown one.
inline double countedRadius_um(float radius_um) { return radius_um > 0 && std::isfinite(radius_um) ? radius_um : 0; }

// As Tile::position_W(), without calls for most tiles.
inline Vector3d ContactTile::position_W(std::uint32_t node) const {
  const std::uint16_t* const offsets = tile->narrowOffsets();
  if (offsets == nullptr) return tile->position_W(node);
  const std::uint16_t* const at = offsets + 3 * std::size_t{node};
  return origin_W + tile->grid().quantum_um() * Vector3d(at[0], at[1], at[2]);
}

inline SegmentEnds ContactTile::ends(const Side& side, std::uint32_t i) const {
  const Side::Item& item = side.items[i];
  SegmentEnds ends{position_W(item.child), position_W(item.parent)};
  if (!side.radii_um.empty()) {
    ends.child_radius_um = countedRadius_um(side.radii_um[i][0]);
    ends.parent_radius_um = countedRadius_um(side.radii_um[i][1]);
  }
  return ends;
}

}  // namespace filiform::internal
