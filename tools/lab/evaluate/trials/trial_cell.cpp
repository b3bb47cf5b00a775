#include "tools/lab/evaluate/trials/trial_cell.h"

#include "index/ingest/memory_tiles.h"
#include "solver/travel/routes/route.h"

#include <utility>

namespace filiform::tools {

namespace {

void treat(Cell& cell, const CellTreatment& treatment) {
  for (Vector3d& p : cell.positions_um) {
    p.x() += treatment.offset_um;
    if (treatment.round_to_float) p = toSinglePrecision(p);
  }
}

}  // namespace

// g++ 12 at -O2 removes the conversion of two neighbouring doubles to float and back; `volatile` prevents this.
Vector3d toSinglePrecision(const Vector3d& p) {
  const auto rounded = [](double x) {
    const volatile float single = static_cast<float>(x);
    return static_cast<double>(single);
  };
  return {rounded(p.x()), rounded(p.y()), rounded(p.z())};
}

TrialCell::TrialCell(Cell cell, const CellTreatment& treatment) {
  treat(cell, treatment);
  parameters_ = automaticParameters(cell, Grid());
  CellList stream({std::move(cell)});
  store_ = buildTilesInMemory(stream);
  table_ = std::make_unique<TileTable>(store_->tile_count());
  for (TileId id = 0; id < store_->tile_count(); ++id) {
    held_.push_back(store_->load(id));
    table_->add(*held_.back());
  }
  view_ = std::make_unique<GraphView>(*table_, store_->leaves(), store_->grid());
  graph_ = readCell(*store_, 0, false);

  root_.resize(graph_.samples());
  level_.resize(graph_.samples());
  depth_um_.resize(graph_.samples());
  for (const std::uint32_t rank : parentsFirst(graph_.parents)) {
    const std::uint32_t parent = graph_.parents[rank];
    root_[rank] = parent == kNoParent ? rank : root_[parent];
    level_[rank] = parent == kNoParent ? 0 : level_[parent] + 1;
    depth_um_[rank] =
        parent == kNoParent ? 0.0 : depth_um_[parent] + (graph_.position_W(rank) - graph_.position_W(parent)).norm();
  }
  stored_.resize(graph_.samples());
  for (const auto& tile : held_)
    for (std::uint32_t segment = 0; segment < tile->segment_count(); ++segment)
      if (tile->owned(segment)) stored_[tile->segmentId(segment).segment] = {tile.get(), segment};
}

const SegmentTree& TrialCell::tree(std::uint32_t root) {
  const auto found = trees_.find(root);
  if (found != trees_.end()) return found->second;
  std::vector<std::uint32_t> children;
  for (std::uint32_t rank = 0; rank < graph_.samples(); ++rank)
    if (root_[rank] == root && rank != root) children.push_back(rank);
  return trees_.emplace(root, SegmentTree(graph_, children)).first->second;
}

ProxyPlace TrialCell::placeAt(std::uint32_t child, double t, const Vector3d& p_W) const noexcept {
  const Stored& at = stored_[child];
  return at.tile == nullptr ? ProxyPlace{} : view_->placeOn(*at.tile, at.segment, t, p_W);
}

ProxyPlace TrialCell::placeAt(std::uint32_t child, double t) const noexcept {
  const Stored& at = stored_[child];
  return at.tile == nullptr ? ProxyPlace{} : view_->placeAt(at.tile->id(), at.tile->segmentId(at.segment), t);
}

}  // namespace filiform::tools
