#include "index/ingest/tiling/internal/cell_work.h"

#include "index/cell/soma.h"
#include "index/errors.h"
#include "index/set/internal/cells_file.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace filiform::internal {
namespace {

void checkSizes(const Cell& cell) {
  const std::size_t n = cell.samples();
  if (cell.positions_um.size() != n || cell.radii_um.size() != n || cell.types.size() != n ||
      (cell.isGraph() ? !cell.parents.empty() : cell.parents.size() != n))
    throw UsageError("a cell was handed over with arrays of different lengths");
  for (std::size_t i = 0; i < cell.odd_radii.size(); ++i)
    if (cell.odd_radii[i].rank >= n || (i > 0 && cell.odd_radii[i].rank <= cell.odd_radii[i - 1].rank))
      throw UsageError("a cell was handed over with a radius of no sample");
  if (n >= UINT32_MAX || cell.segmentRanks() >= UINT32_MAX)
    throw InputError(cell.source + ": more than 2^32 - 2 samples or links in one cell");
}

}  // namespace

TakenCell CellWork::take(Cell& cell, std::uint32_t id) {
  checkSizes(cell);
  const std::size_t n = cell.samples();
  const bool large = n > Cell::kSamplesKept;
  TakenCell taken;
  CellRecord& record = taken.record;
  record.source = std::move(cell.source);
  record.name = std::move(cell.name);
  record.samples = n;
  snap(cell, record);
  if (large) cell.positions_um = {};

  findChildren(cell);
  CellDetail detail;
  for (std::uint32_t i = 0; i < n; ++i)
    if ((is_child_[i] & 1) == 0) detail.roots.push_back({i, cell.radii_um[i], cell.types[i]});
  record.roots = detail.roots.size();
  findSomata(cell, detail, taken.somata);
  passSegments(cell, id, record);
  if (large) {
    snapped_ = {};
    is_child_ = {};
  }

  detail.sample_ids = IdRuns(cell.sample_ids);
  detail.block_starts.swap(cell.block_starts);
  detail.header.swap(cell.header);
  for (const OddRadius& odd : cell.odd_radii)
    detail.odd_radii.push_back(
        {odd.rank, std::bit_cast<std::int64_t>(odd.radius_um) -
                       std::bit_cast<std::int64_t>(static_cast<double>(cell.radii_um[odd.rank]))});
  taken.detail = encodeDetail(detail);
  if (large) cell.sample_ids = {};
  taken.digest = cell.digest;
  taken.attributes = std::move(cell.attributes);
  return taken;
}

void CellWork::findSomata(const Cell& cell, const CellDetail& detail, std::vector<SomaRoot>& found) const {
  const auto soma_samples = static_cast<std::size_t>(std::count(cell.types.begin(), cell.types.end(), kSomaType));
  CellSomata somata;
  if (soma_samples > 1 && soma_samples < cell.samples() && !cell.positions_um.empty()) somata = somataOf(cell);
  for (const Soma& soma : somata.somata)
    found.push_back({0, soma.root, grid_.snap(soma.centre_um), static_cast<float>(soma.radius_um)});
  for (const CellDetail::Root& root : detail.roots) {
    const bool is_centre = std::any_of(somata.somata.begin(), somata.somata.end(),
                                       [&](const Soma& soma) { return soma.root == root.rank; });
    if (root.type == kSomaType && !is_centre) found.push_back({0, root.rank, snapped_[root.rank], root.radius_um});
  }
}

void CellWork::snap(const Cell& cell, CellRecord& record) {
  snapped_.clear();
  snapped_.reserve(cell.samples());
  for (const Vector3d& p_W : cell.positions_um) {
    snapped_.push_back(grid_.snap(p_W));
    record.bounds.extend(snapped_.back());
  }
}

void CellWork::findChildren(const Cell& cell) {
  const std::size_t n = cell.samples();
  is_child_.assign(n, 0);
  if (!cell.isGraph()) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t parent = cell.parents[i];
      if (parent == kNoParent) continue;
      if (parent >= n || parent == i) throw UsageError("a cell was handed over with a parent that does not exist");
      is_child_[i] = 1;
      is_child_[parent] |= 2;
    }
  } else {
    for (const auto& [child, parent] : cell.links) {
      if (child >= n || parent >= n) throw UsageError("a cell was handed over with a link to nowhere");
      if (child != parent) is_child_[child] |= 1;
    }
  }
}

void CellWork::passSegments(const Cell& cell, std::uint32_t id, CellRecord& record) {
  const auto ranks = static_cast<std::uint32_t>(cell.segmentRanks());
  SegmentRecord segment = SegmentChain::first();
  for (std::uint32_t rank = 0; rank < ranks; ++rank) {
    const auto [child, parent] = cell.ends(rank);
    if (child == parent) {
      if (is_child_[child] != 0) continue;  // the root of a tree
      ++record.isolated;
    } else {
      ++record.segments;
    }
    segment = {{id, rank}, child, parent, snapped_[child], snapped_[parent], cell.radii_um[child], cell.types[child]};
    survey_.addLength(segment.child, segment.parent);
    chunks_.add(segment);
  }
}

}  // namespace filiform::internal
