#include "index/contacts/internal/contact_tile.h"

namespace filiform::internal {

std::uint64_t ContactTile::bytes() const {
  std::uint64_t sum = sizeof *this + tile->bytes() + owners.capacity() * sizeof(Owner);
  for (const Side& side : sides)
    sum += side.row.bytes() + side.items.capacity() * sizeof(Side::Item) +
           side.radii_um.capacity() * sizeof(side.radii_um[0]);
  return sum;
}

}  // namespace filiform::internal
