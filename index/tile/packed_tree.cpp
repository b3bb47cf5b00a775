#include "index/tile/packed_tree.h"

#include "index/errors.h"
#include "index/tile/internal/packed_boxes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace filiform {
namespace {

namespace boxes = internal::packed;

class PackedTree final : public TileEngine {
 public:
  PackedTree(std::shared_ptr<const Tile> tile, const boxes::Kernels& kernels, SomeRuns some)
      : tile_(std::move(tile)),
        kernels_(kernels),
        some_(some ? *std::move(some) : std::vector<SegmentRun>()),
        runs_(some ? std::span<const SegmentRun>(some_) : tile_->runs()),
        boxes_{tile_.get(), runs_.data(), 0, 0, {}, {}, {}, {}} {
    build();
  }

  void search(const Vector3d& h_W, Candidates& best) const override;
  void collect(const Region& region, std::vector<std::uint32_t>& segments) const override;
  std::size_t bytes() const override { return sizeof *this + some_.size() * sizeof(SegmentRun) + boxes_.bytes(); }

 private:
  void build();
  void copyPoints();

  std::shared_ptr<const Tile> tile_;
  const boxes::Kernels& kernels_;
  const std::vector<SegmentRun> some_;
  const std::span<const SegmentRun> runs_;  // of the tile, or some
  boxes::Boxes boxes_;
  double unit_um_ = 1, size_um_ = 0;  // size: the tile's largest coordinate
  Vector3d origin_W_ = Vector3d::Zero();
};

void PackedTree::build() {
  const std::size_t runs = runs_.size();
  if (runs == 0) return;
  std::uint32_t nodes = 0;
  for (auto children = static_cast<std::uint32_t>(runs);;) {
    const boxes::Level& level = boxes_.levels[boxes_.level_count++] = {nodes, children};
    nodes += children = level.nodes();
    if (children <= boxes::kTopNodes) break;
  }
  boxes::Node nothing;
  for (std::size_t axis = 0; axis < 3; ++axis) nothing.lo[axis].fill(UINT16_MAX), nothing.hi[axis].fill(0);
  boxes_.nodes.resize(nodes, nothing);

  // One bit is reserved for the carry of rounding up.
  boxes_.shift = tile_->offset_bits() <= 16 ? 0 : tile_->offset_bits() - 15;
  copyPoints();
  kernels_.build(boxes_);

  const Grid grid = tile_->grid();
  unit_um_ = std::ldexp(grid.quantum_um(), boxes_.shift);
  origin_W_ = grid.toWorld(tile_->origin());
  size_um_ = origin_W_.cwiseAbs().maxCoeff() + unit_um_ * 65536.0;
}

// Reads four nodes from the first child of a run on: the offsets have room for them.
void PackedTree::copyPoints() {
  const auto count = static_cast<std::uint32_t>(runs_.size());
  if (const std::uint16_t* const offsets = tile_->narrowOffsets(); offsets != nullptr) {
    boxes_.narrow.resize(count);
    for (std::uint32_t r = 0; r < count; ++r) {
      const boxes::RunEnds ends = boxes_.endsOf(r);
      const std::uint16_t *const child = offsets + 3 * std::size_t{ends.child}, *const parent =
                                                                                    offsets +
                                                                                    3 * std::size_t{ends.parent};
      boxes::NarrowRun& run = boxes_.narrow[r];
      for (std::size_t i = 0; i < boxes::kRun; ++i)
        run.x[i] = child[3 * i], run.y[i] = child[3 * i + 1], run.z[i] = child[3 * i + 2];
      run.parent = {parent[0], parent[1], parent[2]};
      run.count = static_cast<std::uint16_t>(ends.count);
    }
  } else if (const std::uint64_t* const words = tile_->wordOffsets(); words != nullptr) {
    boxes_.words.resize(count);
    for (std::uint32_t r = 0; r < count; ++r) {
      const boxes::RunEnds ends = boxes_.endsOf(r);
      boxes::WordRun& run = boxes_.words[r];
      std::copy_n(words + ends.child, boxes::kRun, run.child.begin());
      run.parent = words[ends.parent];
      run.count = ends.count;
    }
  }
}

void PackedTree::search(const Vector3d& h_W, Candidates& best) const {
  if (boxes_.level_count == 0) return;
  // In units. The margin covers four times the rounding to float, and the error of closestPoint().
  const Vector3d h = (h_W - origin_W_) / unit_um_;
  const double reach = h.cwiseAbs().maxCoeff();
  if (!(reach < 1e15)) {
    for (std::uint32_t run = 0; run < runs_.size(); ++run) boxes_.searchRun(run, h_W, best);
    return;
  }
  constexpr double kUlps = 16 * std::numeric_limits<double>::epsilon();
  const double margin =
      std::ldexp(reach, -22) + kUlps * (size_um_ + h_W.cwiseAbs().maxCoeff()) / unit_um_ + std::ldexp(1.0, -40);
  const double per_quantum = unit_um_ / tile_->grid().quantum_um();
  boxes::Query query;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double at = h[static_cast<Eigen::Index>(axis)];
    query.lo[axis] = static_cast<float>(at - margin);
    query.hi[axis] = static_cast<float>(at + margin);
    query.near[axis] = static_cast<float>(at * per_quantum);
  }
  query.per_quantum = static_cast<float>(per_quantum);
  // A coordinate errs by at most the margin and half a unit, and so does a point on a segment.
  query.sift_margin = static_cast<float>((margin * per_quantum + std::ldexp(1.0, tile_->offset_bits() - 18)) * 8);
  query.per_unit2 = 1 / (unit_um_ * unit_um_);
  const bool wide = boxes_.lean() && best.single() && reach < 0x1p24;
  (wide ? kernels_.searchNearest : kernels_.searchOrdered)(boxes_, query, h_W, best);
}

void PackedTree::collect(const Region& region, std::vector<std::uint32_t>& segments) const {
  if (boxes_.level_count == 0) return;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> stack;
  const std::uint32_t top = boxes_.level_count - 1;
  for (std::uint32_t at = 0; at < boxes_.levels[top].nodes(); ++at) stack.emplace_back(top, at);
  while (!stack.empty()) {
    const auto [level, at] = stack.back();
    stack.pop_back();
    const boxes::Node& node = boxes_.nodes[boxes_.levels[level].begin + at];
    for (unsigned left = boxes_.present(level, at); left != 0; left &= left - 1) {
      const auto i = static_cast<std::uint32_t>(std::countr_zero(left));
      const Vector3d lo(node.lo[0][i], node.lo[1][i], node.lo[2][i]), hi(node.hi[0][i], node.hi[1][i], node.hi[2][i]);
      if (!region.mayMeet({origin_W_ + unit_um_ * lo, origin_W_ + unit_um_ * hi})) continue;
      if (level > 0) {
        stack.emplace_back(level - 1, boxes::kWidth * at + i);
        continue;
      }
      const SegmentRun run = runs_[boxes::kWidth * at + i];
      for (std::uint32_t s = 0; s < run.count(); ++s) segments.push_back(run.begin() + s);
    }
  }
}

}  // namespace

void internal::packed::Boxes::offer(std::uint32_t run, std::uint32_t i, const Vector3d& h_W, Candidates& best) const {
  const RunEnds ends = endsOf(run);
  const std::uint32_t child = ends.child + i, parent = i == 0 ? ends.parent : child - 1;
  best.offer(*tile, runs[run].begin() + i, tile->position_W(child), tile->position_W(parent), h_W);
}

void internal::packed::Boxes::searchRun(std::uint32_t run, const Vector3d& h_W, Candidates& best) const {
  const SegmentRun r = runs[run];
  const RunEnds ends = endsOf(run);
  Vector3d parent_W = tile->position_W(ends.parent);
  for (std::uint32_t i = 0; i < r.count(); ++i) {
    const Vector3d child_W = tile->position_W(ends.child + i);
    best.offer(*tile, r.begin() + i, child_W, parent_W, h_W);
    parent_W = child_W;
  }
}

std::vector<std::string> packedTreePaths() {
  std::vector<std::string> paths;
  for (const boxes::Kernels& kernels : boxes::kernelsHere()) paths.emplace_back(kernels.name);
  return paths;
}

std::unique_ptr<TileEngine> makePackedTree(std::shared_ptr<const Tile> tile, const std::string& path, SomeRuns some) {
  const std::vector<boxes::Kernels>& all = boxes::kernelsHere();
  if (path.empty()) return std::make_unique<PackedTree>(std::move(tile), all.back(), std::move(some));
  const auto at =
      std::find_if(all.begin(), all.end(), [&](const boxes::Kernels& kernels) { return path == kernels.name; });
  if (at == all.end()) throw UsageError("the packed tree has no path \"" + path + "\" on this machine");
  return std::make_unique<PackedTree>(std::move(tile), *at, std::move(some));
}

}  // namespace filiform
