#include "index/build/internal/cell_intake.h"

#include "index/cell/soma.h"
#include "index/errors.h"
#include "index/set/internal/cells_file.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kBytesOfCell = 512;  // without its names; measured with margins, since vectors grow by halves

std::uint64_t heapBytes(const std::string& text) { return text.size() < 16 ? 0 : text.size() + 32; }

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

void CellIntake::take(Cell& cell, Chunks& chunks, LandmarkSurvey& survey) {
  checkSizes(cell);
  if (records_.size() == UINT32_MAX - 1)
    throw InputError("more than 2^32 - 2 cells: split the input into several sets");
  const std::size_t n = cell.samples();
  const bool large = n > Cell::kSamplesKept;
  CellRecord record;
  record.source = std::move(cell.source);
  record.samples = n;
  snap(cell, record);
  if (large) cell.positions_um = {};

  findChildren(cell);
  CellDetail detail;
  for (std::uint32_t i = 0; i < n; ++i)
    if ((is_child_[i] & 1) == 0) detail.roots.push_back({i, cell.radii_um[i], cell.types[i]});
  record.roots = detail.roots.size();
  findSomata(cell, detail);
  passSegments(cell, record, chunks, survey);
  segments_ += record.segments + record.isolated;
  if (large) {
    snapped_ = {};
    is_child_ = {};
  }

  detail.sample_ids = std::move(cell.sample_ids);
  detail.block_starts = std::move(cell.block_starts);
  detail.header = std::move(cell.header);
  for (const OddRadius& odd : cell.odd_radii)
    detail.odd_radii.push_back(
        {odd.rank, std::bit_cast<std::int64_t>(odd.radius_um) -
                       std::bit_cast<std::int64_t>(static_cast<double>(cell.radii_um[odd.rank]))});
  keepDetail(detail);
  bytes_ += kBytesOfCell + 4 * heapBytes(record.source) + 3 * heapBytes(cell.name);
  given_names_.push_back(std::move(cell.name));
  digests_.push_back(cell.digest);
  if (for_others_) {
    for (const CellAttribute& attribute : cell.attributes) bytes_ += 128 + attribute.name.size();
    given_attributes_.push_back(cell.attributes);
  } else {
    attributes_.add(static_cast<std::uint32_t>(records_.size()), cell.attributes);
  }
  records_.push_back(std::move(record));
}

void CellIntake::findSomata(const Cell& cell, const CellDetail& detail) {
  const auto id = static_cast<std::uint32_t>(records_.size());
  const auto soma_samples = static_cast<std::size_t>(std::count(cell.types.begin(), cell.types.end(), kSomaType));
  CellSomata somata;
  if (soma_samples > 1 && soma_samples < cell.samples() && !cell.positions_um.empty()) somata = somataOf(cell);
  for (const Soma& soma : somata.somata)
    somata_.push_back({id, soma.root, grid_.snap(soma.centre_um), static_cast<float>(soma.radius_um)});
  for (const CellDetail::Root& root : detail.roots) {
    const bool found = std::any_of(somata.somata.begin(), somata.somata.end(),
                                   [&](const Soma& soma) { return soma.root == root.rank; });
    if (root.type == kSomaType && !found) somata_.push_back({id, root.rank, snapped_[root.rank], root.radius_um});
  }
}

void CellIntake::take(StoredCells::One cell) {
  keepBytes(withTiles(cell.detail, [](std::vector<TileId>& tiles) { tiles.clear(); }));
  CellRecord& record = cell.record;
  segments_ += record.segments + record.isolated;
  bytes_ += kBytesOfCell + 4 * heapBytes(record.source) + 3 * heapBytes(record.name);
  given_names_.push_back(std::move(record.name));
  digests_.push_back(cell.digest);
  attributes_.add(static_cast<std::uint32_t>(records_.size()), cell.attributes);
  for (SomaRoot soma : cell.somata) {
    soma.cell = static_cast<std::uint32_t>(records_.size());
    somata_.push_back(soma);
  }
  records_.push_back(std::move(record));
}

void CellIntake::snap(const Cell& cell, CellRecord& record) {
  snapped_.clear();
  snapped_.reserve(cell.samples());
  for (const Vector3d& p_W : cell.positions_um) {
    snapped_.push_back(grid_.snap(p_W));
    record.bounds.extend(snapped_.back());
  }
}

void CellIntake::findChildren(const Cell& cell) {
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

void CellIntake::passSegments(const Cell& cell, CellRecord& record, Chunks& chunks, LandmarkSurvey& survey) {
  const auto id = static_cast<std::uint32_t>(records_.size());
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
    survey.addLength(segment.child, segment.parent);
    chunks.add(segment);
  }
}

void CellIntake::keepDetail(const CellDetail& detail) { keepBytes(encodeDetail(detail)); }

void CellIntake::keepBytes(ByteSpan bytes) {
  const std::uint64_t size = bytes.size();
  details_.append({reinterpret_cast<const std::uint8_t*>(&size), sizeof size});
  details_.append(bytes);
}

GridBox CellIntake::bounds() const {
  GridBox bounds;
  for (const CellRecord& cell : records_)
    if (!cell.bounds.empty()) bounds.extend(cell.bounds);
  return bounds;
}

void CellIntake::finish() {
  details_.close();
  snapped_ = {};
  is_child_ = {};
  std::vector<std::string> sources;
  sources.reserve(records_.size());
  for (const CellRecord& record : records_) sources.push_back(record.source);
  std::vector<std::string> names = cellNames(sources, given_names_);
  given_names_ = {};
  for (std::size_t i = 0; i < names.size(); ++i) records_[i].name = std::move(names[i]);
}

void CellIntake::limitDetails(std::uint64_t most_bytes) {
  if (details_.bytes() > most_bytes) details_.spill();
}

void CellIntake::readDetails(const std::function<void(std::uint32_t cell, ByteSpan detail)>& use) {
  ByteChain::Reader rest(details_, true);
  for (std::uint32_t cell = 0; cell < records_.size(); ++cell) {
    std::uint64_t size = 0;
    rest.read(reinterpret_cast<std::uint8_t*>(&size), sizeof size);
    Bytes bytes(size);
    rest.read(bytes.data(), size);
    use(cell, ByteSpan(bytes).subspan(1));  // after the number of tiles, 0
  }
}

}  // namespace filiform::internal
