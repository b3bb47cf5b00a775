#include "index/verify.h"

#include "index/closest_point.h"
#include "index/errors.h"
#include "index/internal/bytes.h"
#include "index/internal/grid_cells.h"
#include "index/internal/tile_entry.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <unordered_map>

namespace filiform {
namespace {

using internal::GridCells;
using internal::Placement;

class Checker {
 public:
  Checker(VerifyReport& report, const VerifyOptions& options) : report_(report), options_(options) {}

  void problem(const std::string& what) {
    if (report_.problem_count++ < VerifyReport::kMaxProblems) report_.problems.push_back(what);
  }
  void require(bool good, const std::string& what) {
    if (!good) problem(what);
  }
  // Runs a check that throws on damage.
  template <typename Check>
  void attempt(Check check) {
    try {
      check();
    } catch (const CorruptSet& damage) {
      problem(damage.what());
    }
  }
  void step(const char* phase, std::uint64_t done, std::uint64_t total) {
    if (options_.cancel != nullptr && options_.cancel->load(std::memory_order_relaxed))
      throw Interrupted("interrupted");
    if (options_.progress) options_.progress(phase, done, total);
  }

 private:
  VerifyReport& report_;
  const VerifyOptions& options_;
};

// The cells as their owners in the tiles have them.
class OwnedCells final : public CellStream {
 public:
  OwnedCells(const TileSet& set, Checker& checker) {
    cells_.resize(set.cell_count());
    std::vector<std::vector<std::uint8_t>> seen(cells_.size());
    for (std::uint32_t c = 0; c < cells_.size(); ++c) {
      Cell& cell = cells_[c];
      CellDetail detail = set.loadCellDetail(c);
      const std::size_t n = detail.sample_ids.size();
      cell.source = set.cell(c).source;
      cell.sample_ids = std::move(detail.sample_ids);
      cell.block_starts = std::move(detail.block_starts);
      cell.positions_um.assign(n, Vector3d::Zero());
      cell.parents.assign(n, kNoParent);
      cell.radii_um.assign(n, kUnknownRadius);
      cell.types.assign(n, 0);
      seen[c].assign(n, 0);
      for (const CellDetail::Root& root : detail.roots) {
        cell.radii_um[root.rank] = root.radius_um;
        cell.types[root.rank] = root.type;
        seen[c][root.rank] |= kRoot;
      }
    }
    for (TileId t = 0; t < set.tile_count(); ++t) {
      checker.step("gathering cells", t, set.tile_count());
      gather(set, t, seen, checker);
    }
    for (std::uint32_t c = 0; c < cells_.size(); ++c)
      for (std::uint32_t i = 0; i < seen[c].size(); ++i) {
        const std::string name = "cell " + std::to_string(c) + ", sample " + std::to_string(i);
        checker.require((seen[c][i] & kPlaced) != 0, name + ": in no tile");
        checker.require((seen[c][i] & (kLinked | kRoot)) != 0, name + ": its segment has no owner");
      }
  }

  bool next(Cell& cell) override {
    if (at_ == cells_.size()) return false;
    cell = std::move(cells_[at_++]);
    return true;
  }

 private:
  static constexpr std::uint8_t kPlaced = 1, kLinked = 2, kRoot = 4;

  void gather(const TileSet& set, TileId t, std::vector<std::vector<std::uint8_t>>& seen, Checker& checker) {
    const std::shared_ptr<const Tile> tile = set.load(t);
    const TileAppearance appearance = set.loadAppearance(t);
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
      const std::uint32_t c = tile->segmentId(s).cell;
      const std::string name = "tile " + std::to_string(t) + ": cell " + std::to_string(c) + ", segment " +
                               std::to_string(tile->segmentId(s).segment);
      const std::uint32_t child = tile->nodeId(tile->child(s)).sample, parent = tile->nodeId(tile->parent(s)).sample;
      if (c >= cells_.size() || child >= seen[c].size() || parent >= seen[c].size()) {
        checker.problem(name + ": there is no such sample");
        continue;
      }
      Cell& cell = cells_[c];
      for (const std::uint32_t node : {tile->child(s), tile->parent(s)}) {
        const std::uint32_t rank = tile->nodeId(node).sample;
        const Vector3d p_W = tile->position_W(node);
        if (seen[c][rank] & kPlaced)
          checker.require(cell.positions_um[rank] == p_W,
                          name + ": sample " + std::to_string(rank) + " is in two places");
        cell.positions_um[rank] = p_W;
        seen[c][rank] |= kPlaced;
      }
      if (!tile->owned(s)) continue;
      checker.require(!(seen[c][child] & kLinked), name + ": owned twice");
      seen[c][child] |= kLinked;
      if (parent == child) continue;
      checker.require(!(seen[c][child] & kRoot), name + ": its child is a root");
      cell.parents[child] = parent;
      cell.radii_um[child] = appearance.radii_um[s];
      cell.types[child] = appearance.types[s];
    }
  }

  std::vector<Cell> cells_;
  std::size_t at_ = 0;
};

bool sameTile(const Tile& a, const Tile& b) {
  if (a.segment_count() != b.segment_count() || a.node_count() != b.node_count() || a.bytes() != b.bytes())
    return false;
  for (std::uint32_t n = 0; n < a.node_count(); ++n)
    if (a.nodeId(n) != b.nodeId(n) || a.gridPoint(n) != b.gridPoint(n)) return false;
  for (std::uint32_t s = 0; s < a.segment_count(); ++s)
    if (a.segmentId(s) != b.segmentId(s) || a.child(s) != b.child(s) || a.parent(s) != b.parent(s) ||
        a.owned(s) != b.owned(s))
      return false;
  return true;
}

bool sameBits(const std::vector<float>& a, const std::vector<float>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](float x, float y) {
    return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
  });
}

// Cutting the cells again must give these very tiles: that is ownership, homes, ghosts and leaves in one.
void checkTiles(const TileSet& set, const GridCells& cells, const Placement& placement, Checker& checker) {
  const bool has_long = set.long_tile() != kNoTile;
  if (placement.tile_count() != set.tile_count() || placement.has_long != has_long) {
    checker.problem("the segments make " + std::to_string(placement.tile_count()) + " tiles, the set has " +
                    std::to_string(set.tile_count()));
    return;
  }
  for (TileId t = 0; t < set.tile_count(); ++t) {
    checker.step("cutting again", t, set.tile_count());
    const std::string name = "tile " + std::to_string(t);
    if (placement.key(t) != set.entry(t).key) {
      checker.problem(name + ": its cell is not a leaf of these segments");
      continue;
    }
    const std::shared_ptr<const Tile> expected = internal::buildTile(cells, placement, t);
    checker.require(sameTile(*expected, *set.load(t)), name + ": does not hold the segments that meet its cell");
    const TileAppearance a = internal::buildAppearance(cells, placement, t), b = set.loadAppearance(t);
    checker.require(a.types == b.types && sameBits(a.radii_um, b.radii_um),
                    name + ": radii or types differ from their owners'");
    const TileEntry entry = internal::entryOf(*expected), &stated = set.entry(t);
    checker.require(entry.owned == stated.owned && entry.stored == stated.stored && entry.isolated == stated.isolated &&
                        entry.decoded_bytes == stated.decoded_bytes,
                    name + ": the directory's counts are wrong");
    checker.require(entry.content.lo == stated.content.lo && entry.content.hi == stated.content.hi,
                    name + ": the directory's box is wrong");
  }
}

void checkCells(const TileSet& set, const GridCells& cells, const Placement& placement, Checker& checker) {
  const std::vector<std::vector<TileId>> owning = internal::owningTiles(cells, placement);
  SetCounts sum = set.counts();
  sum.samples = sum.segments = sum.isolated = sum.roots = 0;
  GridBox bounds;
  for (std::uint32_t c = 0; c < cells.cell_count(); ++c) {
    const CellRecord &expected = cells.records()[c], &stated = set.cell(c);
    const std::string name = "cell " + std::to_string(c);
    checker.require(expected.name == stated.name && set.findCell(stated.name) == c,
                    name + ": its name does not follow from its source");
    checker.require(expected.samples == stated.samples && expected.segments == stated.segments &&
                        expected.isolated == stated.isolated && expected.roots == stated.roots,
                    name + ": its counts are wrong");
    checker.require(expected.bounds.lo == stated.bounds.lo && expected.bounds.hi == stated.bounds.hi,
                    name + ": its bounds are wrong");
    checker.require(owning[c] == set.loadCellDetail(c).tiles, name + ": its list of tiles is wrong");
    bounds.extend(expected.bounds);
    sum.samples += expected.samples, sum.segments += expected.segments;
    sum.isolated += expected.isolated, sum.roots += expected.roots;
  }
  checker.require(sum == set.counts(), "the manifest's counts are wrong");
  checker.require(
      (bounds.empty() && set.bounds().empty()) || (bounds.lo == set.bounds().lo && bounds.hi == set.bounds().hi),
      "the manifest's bounds are wrong");
}

// Sample points in cubes of the covering radius, so that a point's samples are in its own cube or the 26 around it.
class SampleGrid {
 public:
  SampleGrid(const SamplePoints& samples, const Grid& grid) : grid_(grid), radius_um_(samples.covering_radius_um) {
    side_um_ = std::max(radius_um_, grid.quantum_um());
    for (const GridPoint& p : samples.points) cubes_.emplace(key(cube(grid.toWorld(p))), grid.toWorld(p));
  }
  bool covers(const Vector3d& p_W) const {
    const GridPoint centre = cube(p_W);
    for (int i = 0; i < 27; ++i) {
      const auto [begin, end] = cubes_.equal_range(key(centre + GridPoint(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
      for (auto at = begin; at != end; ++at)
        if ((at->second - p_W).norm() <= radius_um_) return true;
    }
    return false;
  }

 private:
  GridPoint cube(const Vector3d& p_W) const { return (p_W / side_um_).array().floor().cast<std::int64_t>(); }
  static std::uint64_t key(const GridPoint& c) {
    return internal::checksum({reinterpret_cast<const std::uint8_t*>(c.data()), 3 * sizeof(std::int64_t)});
  }
  Grid grid_;
  double radius_um_, side_um_;
  std::unordered_multimap<std::uint64_t, Vector3d> cubes_;
};

void checkSamples(const TileSet& set, const GridCells& cells, Checker& checker) {
  const SamplePoints& samples = set.samples();
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    const SegmentId id = samples.segments[i];
    const std::string name = "sample point " + std::to_string(i);
    if (id.cell >= cells.cell_count() || id.segment >= cells.records()[id.cell].samples ||
        !cells.isSegment(cells.begin(id.cell) + id.segment)) {
      checker.problem(name + ": there is no such segment");
      continue;
    }
    const std::uint32_t s = cells.begin(id.cell) + id.segment;
    const ClosestPoint c = closestPoint(cells.grid().toWorld(cells.position(s)),
                                        cells.grid().toWorld(cells.position(cells.other(s, id.cell))),
                                        cells.grid().toWorld(samples.points[i]));
    checker.require(std::sqrt(c.squared_distance) <= cells.grid().quantum_um(), name + ": does not lie on its segment");
  }
  const SampleGrid near(samples, cells.grid());
  for (std::uint32_t c = 0; c < cells.cell_count(); ++c)
    for (std::uint32_t s = cells.begin(c); s < cells.begin(c + 1); ++s) {
      if (!cells.isSegment(s)) continue;
      const Vector3d a = cells.grid().toWorld(cells.position(s)),
                     b = cells.grid().toWorld(cells.position(cells.other(s, c)));
      checker.require(near.covers(a) && near.covers(b) && near.covers((a + b) / 2),
                      "cell " + std::to_string(c) + ", segment " + std::to_string(s - cells.begin(c)) +
                          ": farther from every sample point than the covering radius");
    }
}

}  // namespace

VerifyReport verify(const std::string& path, const VerifyOptions& options) {
  VerifyReport report;
  Checker checker(report, options);
  std::unique_ptr<TileSet> set;
  checker.attempt([&] { set = TileSet::open(path); });
  if (set == nullptr) return report;
  for (const SetFile& file : set->files()) {
    checker.step("checking files", report.bytes, set->bytes());
    checker.attempt([&] { set->checkFile(file); });
    report.bytes += file.bytes;
  }
  for (TileId t = 0; t < set->tile_count(); ++t) {
    checker.step("checking tiles", t, set->tile_count());
    checker.attempt([&] { set->load(t); });
    checker.attempt([&] { set->loadAppearance(t); });
    ++report.tiles;
  }
  checker.attempt([&] {
    for (std::uint32_t c = 0; c < set->cell_count(); ++c) set->loadCellDetail(c), set->cell(c);
  });
  checker.attempt([&] { set->samples(); });
  if (!options.deep || !report.sound()) return report;

  checker.attempt([&] {
    OwnedCells owned(*set, checker);
    if (!report.sound()) return;
    const GridCells cells(owned, set->grid(), options.cancel);
    const Placement placement = internal::place(cells, set->capacity(), options.cancel);
    checkTiles(*set, cells, placement, checker);
    checkCells(*set, cells, placement, checker);
    checker.step("checking sample points", 0, 0);
    checkSamples(*set, cells, checker);
  });
  return report;
}

}  // namespace filiform
