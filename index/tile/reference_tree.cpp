#include "index/tile/reference_tree.h"

#include "index/tile/internal/box_tree.h"

#include <utility>

namespace filiform {
namespace {

std::vector<WorldBox> segmentBoxes(const Tile& tile) {
  std::vector<WorldBox> boxes(tile.segment_count());
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    const Vector3d a_W = tile.position_W(tile.child(s)), b_W = tile.position_W(tile.parent(s));
    boxes[s] = {a_W.cwiseMin(b_W), a_W.cwiseMax(b_W)};
  }
  return boxes;
}

class ReferenceTree : public TileEngine {
 public:
  explicit ReferenceTree(std::shared_ptr<const Tile> tile) : tile_(std::move(tile)), tree_(segmentBoxes(*tile_)) {}

  void search(const Vector3d& h_W, Candidates& best) const override {
    tree_.descend(
        h_W, [&] { return best.bound2(); },
        [&](std::uint32_t s, double) {
          best.offer(*tile_, s, tile_->position_W(tile_->child(s)), tile_->position_W(tile_->parent(s)), h_W);
        });
  }

  void collect(const Region& region, std::vector<std::uint32_t>& segments) const override {
    tree_.collect(region, [&](std::uint32_t s) { segments.push_back(s); });
  }

  std::size_t bytes() const override { return sizeof *this + tree_.bytes(); }

 private:
  std::shared_ptr<const Tile> tile_;
  internal::BoxTree tree_;
};

}  // namespace

std::unique_ptr<TileEngine> makeReferenceTree(std::shared_ptr<const Tile> tile) {
  return std::make_unique<ReferenceTree>(std::move(tile));
}

}  // namespace filiform
