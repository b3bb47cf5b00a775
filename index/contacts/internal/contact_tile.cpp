#include "index/contacts/internal/contact_tile.h"

#include <cmath>

namespace filiform::internal {

RoundedBox::RoundedBox(const WorldBox& box, double more_um) {
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    lo[at] = std::nextafterf(static_cast<float>(box.lo_W[i] - more_um), -HUGE_VALF);
    hi[at] = std::nextafterf(static_cast<float>(box.hi_W[i] + more_um), HUGE_VALF);
  }
}

void BoxRow::finish() {
  for (std::size_t level = 1; level < levels.size(); ++level) {
    levels[level].assign((levels[level - 1].size() + kFew - 1) / kFew, {});
    for (std::size_t i = 0; i < levels[level - 1].size(); ++i) levels[level][i / kFew].extend(levels[level - 1][i]);
  }
}

std::uint64_t BoxRow::bytes() const {
  std::uint64_t boxes = 0;
  for (const auto& level : levels) boxes += level.capacity();
  return boxes * sizeof(RoundedBox);
}

WorldBox ContactSegment::box() const {
  const Vector3d about_child = Vector3d::Constant(ends.child_radius_um);
  const Vector3d about_parent = Vector3d::Constant(ends.parent_radius_um);
  return {(ends.child_W - about_child).cwiseMin(ends.parent_W - about_parent),
          (ends.child_W + about_child).cwiseMax(ends.parent_W + about_parent)};
}

std::uint64_t ContactTile::bytes() const {
  return sizeof *this + segments.capacity() * sizeof(ContactSegment) + boxes.bytes() +
         owners.capacity() * sizeof(Owner);
}

}  // namespace filiform::internal
