#include "index/formats/internal/tree_joins.h"

namespace filiform::internal {
namespace {

std::array<double, 3> keyOf(const Vector3d& position) { return {position.x(), position.y(), position.z()}; }

}  // namespace

void TreeJoins::begins(std::size_t point, const Vector3d& position) {
  const auto tree = static_cast<std::uint32_t>(joined_.size());
  joined_.push_back(tree);
  if (position.allFinite()) begins_[keyOf(position)].push_back({point, tree});
}

void TreeJoins::inside(std::size_t point, const Vector3d& position, std::uint32_t tree) {
  if (!position.allFinite()) return;
  const auto found = begins_.find(keyOf(position));
  if (found == begins_.end()) return;
  std::erase_if(found->second, [&](const Begin& begin) {  // at most one tree stays: the first one of this group
    const std::uint32_t own = groupOf(tree), other = groupOf(begin.tree);
    if (own == other) return false;
    joined_[other] = own;
    stands_for_.emplace(begin.point, point);
    return true;
  });
}

std::size_t TreeJoins::at(std::size_t point) const {
  if (stands_for_.empty()) return point;
  const auto found = stands_for_.find(point);
  return found == stands_for_.end() ? point : found->second;
}

std::uint32_t TreeJoins::groupOf(std::uint32_t tree) {
  while (joined_[tree] != tree) tree = joined_[tree] = joined_[joined_[tree]];
  return tree;
}

}  // namespace filiform::internal
