#include "index/tile/reference_tree.h"

#include "index/tile/internal/box_tree.h"

#include <numeric>
#include <utility>

namespace filiform {
namespace {

std::vector<std::uint32_t> segmentsOfRuns(const Tile& tile, const SomeRuns& some) {
  std::vector<std::uint32_t> segments(some ? 0 : tile.segment_count());
  std::iota(segments.begin(), segments.end(), 0);
  if (some)
    for (const SegmentRun run : *some)
      for (std::uint32_t i = 0; i < run.count(); ++i) segments.push_back(run.begin() + i);
  return segments;
}

std::vector<WorldBox> segmentBoxes(const Tile& tile, const std::vector<std::uint32_t>& segments) {
  std::vector<WorldBox> boxes;
  for (const std::uint32_t s : segments) {
    const Vector3d a_W = tile.position_W(tile.child(s)), b_W = tile.position_W(tile.parent(s));
    boxes.push_back({a_W.cwiseMin(b_W), a_W.cwiseMax(b_W)});
  }
  return boxes;
}

class ReferenceTree : public TileEngine {
 public:
  ReferenceTree(std::shared_ptr<const Tile> tile, const SomeRuns& some)
      : tile_(std::move(tile)), segments_(segmentsOfRuns(*tile_, some)), tree_(segmentBoxes(*tile_, segments_)) {}

  void search(const Vector3d& h_W, Candidates& best) const override {
    tree_.descend(
        h_W, [&] { return best.bound2(); },
        [&](std::uint32_t i, double) {
          const std::uint32_t s = segments_[i];
          best.offer(*tile_, s, tile_->position_W(tile_->child(s)), tile_->position_W(tile_->parent(s)), h_W);
        });
  }

  void collect(const Region& region, std::vector<std::uint32_t>& segments) const override {
    tree_.collect(region, [&](std::uint32_t i) { segments.push_back(segments_[i]); });
  }

  std::size_t bytes() const override { return sizeof *this + segments_.size() * sizeof(std::uint32_t) + tree_.bytes(); }

 private:
  std::shared_ptr<const Tile> tile_;
  std::vector<std::uint32_t> segments_;  // by item of the tree
  internal::BoxTree tree_;
};

}  // namespace

std::unique_ptr<TileEngine> makeReferenceTree(std::shared_ptr<const Tile> tile, SomeRuns some) {
  return std::make_unique<ReferenceTree>(std::move(tile), some);
}

}  // namespace filiform
