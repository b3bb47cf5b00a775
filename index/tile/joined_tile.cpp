// Joins two tiles of one block in linear time.
#include "index/errors.h"
#include "index/tile/tile.h"

#include <algorithm>
#include <bit>

namespace filiform {

Tile::Tile(const Tile& base, const Tile& patch) : Tile(base.id_, base.key_, base.is_long_, base.grid_) {
  if (base.segment_count_ > kMaxSegments - patch.segment_count_)
    throw InputError("a tile would hold more than 2^28 segments: too many have the same midpoint");
  node_count_ = base.node_count_ + patch.node_count_;
  segment_count_ = base.segment_count_ + patch.segment_count_;
  // Placed nodes of the base, then of the patch; strays of the base, then of the patch.
  const auto base_placed = base.node_count_ - static_cast<std::uint32_t>(base.strays_.size());
  const auto patch_placed = patch.node_count_ - static_cast<std::uint32_t>(patch.strays_.size());
  const auto baseNode = [&](std::uint32_t node) { return node < base_placed ? node : node + patch_placed; };
  const auto patchNode = [&](std::uint32_t node) {
    return node + (node < patch_placed ? base_placed : base.node_count_);
  };

  const std::size_t of_base = base.fragments_.size(), of_both = of_base + patch.fragments_.size();
  fragments_.reserve(of_both);
  for (Fragment f : base.fragments_) {
    f.child_node = baseNode(f.child_node);
    f.parent_node = baseNode(f.parent_node);
    fragments_.push_back(f);
  }
  for (Fragment f : patch.fragments_) {
    f.begin += base.segment_count_;
    f.child_node = patchNode(f.child_node);
    f.parent_node = patchNode(f.parent_node);
    fragments_.push_back(f);
  }
  strays_.reserve(base.strays_.size() + patch.strays_.size());
  strays_.assign(base.strays_.begin(), base.strays_.end());
  strays_.insert(strays_.end(), patch.strays_.begin(), patch.strays_.end());
  runs_.reserve(base.runs_.size() + patch.runs_.size());
  runs_.assign(base.runs_.begin(), base.runs_.end());
  for (const SegmentRun run : patch.runs_) runs_.push_back({run.begin_and_count + 8 * base.segment_count_});

  const auto eachFragment = [&](auto&& visit) {
    for (std::size_t f = 0; f < of_both; ++f)
      f < of_base ? visit(base, static_cast<std::uint32_t>(f), f)
                  : visit(patch, static_cast<std::uint32_t>(f - of_base), f);
  };
  if (!base.first_samples_.empty() || !patch.first_samples_.empty()) {
    first_samples_.reserve(of_both);
    eachFragment(
        [&](const Tile& tile, std::uint32_t f, std::size_t) { first_samples_.push_back(tile.firstSample(f)); });
  }
  if (!base.loose_.empty() || !patch.loose_.empty()) {
    loose_.assign((of_both + 31) / 32, 0);
    eachFragment([&](const Tile& tile, std::uint32_t f, std::size_t at) {
      if (!tile.places(f)) loose_[at / 32] |= 1u << (at % 32);
    });
  }
  joinOffsets(base, base_placed, patch, patch_placed);

  std::vector<std::uint32_t> owned((segment_count_ + 31) / 32, 0);
  std::vector<std::uint32_t> strips;
  const auto append = [&](const Tile& tile, std::uint32_t first_segment, std::uint32_t first_node) {
    for (std::uint32_t b = 0; b < tile.segments_.size(); ++b) {
      for (std::uint32_t left = tile.segments_[b].owned; left != 0; left &= left - 1) {
        const std::uint32_t s = first_segment + 32 * b + static_cast<std::uint32_t>(std::countr_zero(left));
        owned[s / 32] |= 1u << (s % 32);
      }
    }
    for (std::uint32_t b = 0; b < tile.nodes_.size(); ++b)
      for (std::uint32_t left = tile.nodes_[b].strips; left != 0; left &= left - 1)
        strips.push_back(first_node + 32 * b + static_cast<std::uint32_t>(std::countr_zero(left)));
  };
  strips.reserve(of_both);
  append(base, 0, 0);
  append(patch, base.segment_count_, base_placed);
  setHomes();
  index(owned, strips);
}

void Tile::joinOffsets(const Tile& base, std::uint32_t base_placed, const Tile& patch, std::uint32_t patch_placed) {
  const auto highest = [](const Tile& tile) {
    GridPoint hi = GridPoint::Zero();
    tile.withOffsets([&](const auto& offsets) {
      for (std::uint32_t node = 0; node < tile.node_count_; ++node) {
        const Offset c = offsets.get(node);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          auto& of_axis = hi[static_cast<Eigen::Index>(axis)];
          of_axis = std::max(of_axis, static_cast<std::int64_t>(c[axis]));
        }
      }
    });
    return GridPoint(tile.origin_ + hi);
  };
  origin_ = base.origin_.cwiseMin(patch.origin_);
  const GridPoint extent = highest(base).cwiseMax(highest(patch)) - origin_;
  offset_bits_ = std::bit_width(static_cast<std::uint64_t>(extent.maxCoeff()));
  fillOffsets([&](const auto& to) {
    const auto copy = [&](const Tile& tile, std::uint32_t begin, std::uint32_t end, std::uint32_t at) {
      const GridPoint shift = tile.origin_ - origin_;
      tile.withOffsets([&](const auto& from) {
        for (std::uint32_t node = begin; node < end; ++node, ++at) {
          Offset c = from.get(node);
          for (std::size_t axis = 0; axis < 3; ++axis)
            c[axis] += static_cast<std::uint64_t>(shift[static_cast<Eigen::Index>(axis)]);
          to.put(at, c);
        }
      });
    };
    copy(base, 0, base_placed, 0);
    copy(patch, 0, patch_placed, base_placed);
    copy(base, base_placed, base.node_count_, base_placed + patch_placed);
    copy(patch, patch_placed, patch.node_count_, base.node_count_ + patch_placed);
  });
}

}  // namespace filiform
