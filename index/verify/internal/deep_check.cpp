#include "index/verify/internal/deep_check.h"

#include "index/errors.h"
#include "index/file/internal/bytes.h"
#include "index/geometry/closest_point.h"
#include "index/geometry/internal/grown_leaves.h"
#include "index/query/cell_graph.h"
#include "index/set/internal/tile_entry.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

namespace filiform::internal {
namespace {

// A 64-bit hash of words.
class Hash {
 public:
  Hash& add(std::uint64_t word) {
    state_ = (state_ ^ word) * 0x9E3779B97F4A7C15u;
    state_ ^= state_ >> 32;
    return *this;
  }
  Hash& add(const GridPoint& p) {
    for (int axis = 0; axis < 3; ++axis) add(static_cast<std::uint64_t>(p[axis]));
    return *this;
  }
  std::uint64_t value() const {
    std::uint64_t h = state_ * 0xD6E8FEB86659FD93u;
    h = (h ^ (h >> 32)) * 0xD6E8FEB86659FD93u;
    return h ^ (h >> 29);
  }

 private:
  std::uint64_t state_ = 0x2545F4914F6CDD1Du;
};

// A bit set.
class Bits {
 public:
  explicit Bits(std::uint64_t n) : words_((n + 63) / 64, 0) {}
  bool operator[](std::uint64_t i) const { return (words_[i / 64] >> (i % 64) & 1) != 0; }
  // Sets bit i. Returns true if it was set before.
  bool set(std::uint64_t i) {
    const std::uint64_t bit = std::uint64_t{1} << (i % 64);
    const bool before = (words_[i / 64] & bit) != 0;
    words_[i / 64] |= bit;
    return before;
  }

 private:
  std::vector<std::uint64_t> words_;
};

// The midpoints in one block of the partition.
struct Load {
  std::uint64_t count = 0;
  MortonKey least = ~MortonKey{0}, most = 0;

  void add(const MortonKey& key) {
    ++count;
    least = std::min(least, key);
    most = std::max(most, key);
  }
  void add(const Load& other) {
    count += other.count;
    least = std::min(least, other.least);
    most = std::max(most, other.most);
  }
  bool mustSplit(std::uint32_t capacity) const { return count > capacity && least != most; }
};

// Landmarks in cubes with edges of the covering radius: the landmarks near a point are in its cube or the 26 around it.
class LandmarkGrid {
 public:
  LandmarkGrid(const Landmarks& landmarks, const Grid& grid) : radius_um_(landmarks.covering_radius_um) {
    side_um_ = std::max(radius_um_, grid.quantum_um());
    for (const GridPoint& p : landmarks.points) cubes_.emplace(key(cube(grid.toWorld(p))), grid.toWorld(p));
  }
  bool covers(const Vector3d& p_W) {
    // Consecutive queries are close together.
    if ((last_ - p_W).norm() <= radius_um_) return true;
    const GridPoint centre = cube(p_W);
    for (int i = 0; i < 27; ++i) {
      const auto [begin, end] = cubes_.equal_range(key(centre + GridPoint(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
      for (auto at = begin; at != end; ++at) {
        if ((at->second - p_W).norm() > radius_um_) continue;
        last_ = at->second;
        return true;
      }
    }
    return false;
  }

 private:
  GridPoint cube(const Vector3d& p_W) const { return (p_W / side_um_).array().floor().cast<std::int64_t>(); }
  static std::uint64_t key(const GridPoint& c) { return Hash().add(c).value(); }

  double radius_um_, side_um_;
  Vector3d last_ = Vector3d::Constant(HUGE_VAL);
  std::unordered_multimap<std::uint64_t, Vector3d> cubes_;
};

std::string nameOf(const SegmentId& id) {
  return "cell " + std::to_string(id.cell) + ", segment " + std::to_string(id.segment);
}

}  // namespace

struct DeepCheck::Impl {
  struct TileSums {
    std::uint64_t ids = 0, geometry = 0;
    bool operator==(const TileSums&) const = default;
    void add(const TileSums& s) { ids += s.ids, geometry += s.geometry; }
  };
  struct CellSums {
    GridBox bounds;
    std::uint64_t segments = 0, isolated = 0;
    std::uint64_t tiles = 0, tile_count = 0, attributes = 0;  // attributes: of isolated samples, which are also roots
    TileId last_tile = kNoTile;
  };

  Impl(const TileSet& tile_set, std::function<void(const std::string&)> on_problem)
      : set(tile_set), problem(std::move(on_problem)), loads(tile_set.tile_count()) {}

  void require(bool good, const std::string& what) {
    if (!good) problem(what);
  }
  std::uint64_t sampleAt(std::uint32_t cell, std::uint32_t rank) const { return sample_begin[cell] + rank; }
  std::uint64_t segmentRanks(std::uint32_t cell) const { return segment_begin[cell + 1] - segment_begin[cell]; }

  void coverWorld();
  Load splitLoad(const BlockKey& block, std::size_t first, std::size_t last);
  bool isShort(bool in_long_tile, const GridPoint& a, const GridPoint& b);
  void own(const Tile& tile, std::uint32_t s, float radius_um, std::uint16_t type);
  void checkLandmark(const SegmentId& id, const Vector3d& a_W, const Vector3d& b_W);
  void nodes(const Tile& tile);
  void checkCell(std::uint32_t c);

  const TileSet& set;
  std::function<void(const std::string&)> problem;

  std::vector<Load> loads;              // by tile: midpoints in its block
  std::vector<MortonKey> long_middles;  // ascending after begin()
  std::vector<BlockKey> leaves;         // of the whole world
  std::vector<TileId> tile_of;          // by leaf
  bool leaves_good = true;
  std::optional<Partition> partition;

  std::vector<std::uint64_t> sample_begin, segment_begin;  // by cell
  std::vector<TileSums> wanted, found;                     // by tile
  std::vector<TypeMask> types;                             // by tile, of the wanted segments
  std::vector<CellSums> cells;
  // By tile: values of the directory that differ from the tile; reported when the tile itself is correct.
  static constexpr std::uint8_t kWrongCounts = 1, kWrongBox = 2;
  std::vector<std::uint8_t> entry_faults;
  std::optional<Bits> owned, at_home, is_child, is_linked;
  std::optional<LandmarkGrid> landmark_grid;
  std::unordered_multimap<std::uint64_t, std::uint32_t>
      landmarks_on;  // by segment: landmarks; those that no tile owns remain at the end
  // A 0 bit means that no segment of this slot has a landmark: most segments need no look-up.
  static constexpr std::uint64_t kLandmarkSlots = std::uint64_t{1} << 21;
  static std::uint64_t landmarkSlot(const SegmentId& id) { return Hash().add(id.key()).value() % kLandmarkSlots; }
  Bits maybe_landmark{kLandmarkSlots};
  GridBox tile_cell;  // of the current tile
  std::vector<std::uint32_t> met;
};

DeepCheck::DeepCheck(const TileSet& set, std::function<void(const std::string&)> problem)
    : impl_(std::make_unique<Impl>(set, std::move(problem))) {}
DeepCheck::~DeepCheck() = default;

void DeepCheck::midpoints(const Tile& tile) {
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    if (!tile.owned(s)) continue;
    const MortonKey key = mortonKey(midpoint(tile.gridPoint(tile.child(s)), tile.gridPoint(tile.parent(s))));
    if (tile.isLong()) {
      impl_->long_middles.push_back(key);
    } else {
      impl_->loads[tile.id()].add(key);
    }
  }
}

// Walks the tree that the stored leaves form. Beside these leaves there are only midpoints of long segments.
Load DeepCheck::Impl::splitLoad(const BlockKey& block, std::size_t first, std::size_t last) {
  const auto key = [this](std::size_t tile) -> const BlockKey& { return set.entry(static_cast<TileId>(tile)).key; };
  const auto middles_begin = std::lower_bound(long_middles.begin(), long_middles.end(), block.low);
  const auto middles_end = std::upper_bound(middles_begin, long_middles.end(), block.high());
  Load load;
  const bool is_stored = last - first == 1 && key(first).depth == block.depth;
  if (first == last || is_stored) {
    if (is_stored) load = loads[first];
    for (auto at = middles_begin; at != middles_end; ++at) load.add(*at);
    if (!load.mustSplit(set.capacity())) {
      leaves.push_back(block);
      tile_of.push_back(is_stored ? static_cast<TileId>(first) : kNoTile);
      return load;
    }
    if (is_stored) {
      problem("tile " + std::to_string(first) +
              ": its block is not a leaf of these segments: it holds more than the capacity");
      leaves_good = false;
      return load;
    }
  }
  if (block.depth >= kMortonBits) {
    leaves_good = false;
    return load;
  }
  const BlockKey low = block.half(0), high = block.half(1);
  std::size_t middle = first;
  while (middle < last && key(middle).low < high.low) ++middle;
  load = splitLoad(low, first, middle);
  load.add(splitLoad(high, middle, last));
  if (leaves_good && !load.mustSplit(set.capacity())) {
    problem("tile " + std::to_string(first) +
            ": its block is not a leaf of these segments: the next larger block suffices");
    leaves_good = false;
  }
  return load;
}

// A grown set has the leaves that it stores, and the largest blocks that fill the space between them.
void DeepCheck::Impl::coverWorld() {
  std::vector<BlockKey> stored;
  for (TileId t = 0; t < set.leaves().size(); ++t) stored.push_back(set.entry(t).key);
  leaves = grownLeaves(stored);
  TileId next = 0;
  for (const BlockKey& leaf : leaves) {
    const bool is_stored = next < stored.size() && stored[next] == leaf;
    tile_of.push_back(is_stored ? next : kNoTile);
    next += is_stored;
  }
  leaves_good = next == stored.size();
  if (!leaves_good) problem("tile " + std::to_string(next) + ": its block is not a leaf");
}

bool DeepCheck::begin() {
  Impl& d = *impl_;
  std::sort(d.long_middles.begin(), d.long_middles.end());
  if (d.set.grown()) {
    d.coverWorld();
  } else {
    d.splitLoad(BlockKey{}, 0, d.set.leaves().size());
  }
  if (!d.leaves_good) return false;
  d.partition.emplace(d.leaves);
  const std::uint32_t n = d.set.cell_count();
  d.sample_begin.assign(1, 0);
  d.segment_begin.assign(1, 0);
  for (std::uint32_t c = 0; c < n; ++c) {
    const CellRecord& record = d.set.cell(c);
    d.sample_begin.push_back(d.sample_begin.back() + record.samples);
    d.segment_begin.push_back(d.segment_begin.back() +
                              (hasLoops(record) ? record.segments + record.isolated : record.samples));
  }
  d.cells.resize(n);
  d.wanted.resize(d.set.tile_count());
  d.types.resize(d.set.tile_count());
  d.found.resize(d.set.tile_count());
  d.entry_faults.assign(d.set.tile_count(), 0);
  d.owned.emplace(d.segment_begin.back());
  d.at_home.emplace(d.sample_begin.back());
  d.is_child.emplace(d.sample_begin.back());
  d.is_linked.emplace(d.sample_begin.back());
  d.landmark_grid.emplace(d.set.landmarks(), d.set.grid());
  for (std::uint32_t i = 0; i < d.set.landmarks().points.size(); ++i) {
    d.landmarks_on.emplace(d.set.landmarks().segments[i].key(), i);
    d.maybe_landmark.set(Impl::landmarkSlot(d.set.landmarks().segments[i]));
  }
  return true;
}

void DeepCheck::Impl::checkLandmark(const SegmentId& id, const Vector3d& a_W, const Vector3d& b_W) {
  const auto [begin, end] = landmarks_on.equal_range(id.key());
  for (auto at = begin; at != end; ++at) {
    const ClosestPoint c = closestPoint(a_W, b_W, set.grid().toWorld(set.landmarks().points[at->second]));
    require(std::sqrt(c.squared_distance) <= set.grid().quantum_um(),
            "landmark " + std::to_string(at->second) + ": does not lie on its segment");
  }
  landmarks_on.erase(begin, end);
}

// Finds the leaves that a segment meets, unless it is a long segment. In a grown set, those of the long-segment tile
// are long, however many leaves they meet now.
bool DeepCheck::Impl::isShort(bool in_long_tile, const GridPoint& a, const GridPoint& b) {
  if (!set.grown()) return partition->leavesMet(a, b, met);
  if (in_long_tile) return false;
  if (partition->leavesMet(a, b, met)) return true;
  met.clear();
  for (std::uint32_t leaf = 0; leaf < leaves.size(); ++leaf)
    if (segmentMeetsBox(a, b, closedBlock(leaves[leaf]))) met.push_back(leaf);
  return true;
}

// The owner of a segment decides which tiles must store it, and what its cell contains.
void DeepCheck::Impl::own(const Tile& tile, std::uint32_t s, float radius_um, std::uint16_t type) {
  const SegmentId id = tile.segmentId(s);
  const std::uint32_t child = tile.nodeId(tile.child(s)).sample, parent = tile.nodeId(tile.parent(s)).sample;
  const GridPoint a = tile.gridPoint(tile.child(s)), b = tile.gridPoint(tile.parent(s));
  // Build texts only for a problem: this runs for every segment.
  const auto name = [&] { return "tile " + std::to_string(tile.id()) + ": " + nameOf(id); };
  if (owned->set(segment_begin[id.cell] + id.segment)) problem(name() + ": owned twice");

  CellSums& cell = cells[id.cell];
  if (cell.last_tile != tile.id()) {
    cell.last_tile = tile.id();
    ++cell.tile_count;
    cell.tiles += Hash().add(tile.id()).value();
  }
  if (child == parent) {
    ++cell.isolated;
    cell.attributes += Hash().add(child).add(std::bit_cast<std::uint32_t>(radius_um)).add(type).value();
  } else {
    ++cell.segments;
    is_child->set(sampleAt(id.cell, child));
    is_linked->set(sampleAt(id.cell, child));
    is_linked->set(sampleAt(id.cell, parent));
  }

  const auto want = [&](TileId t, bool is_owner) {
    if (t == kNoTile) return problem(name() + ": meets a leaf that is missing in the set");
    const std::uint64_t ids = Hash().add(id.key()).add(is_owner).value();
    types[t] |= typeMaskOf(type);
    wanted[t].add({ids, Hash().add(ids).add(child).add(parent).add(a).add(b).value()});
  };
  // A segment inside the block, off its lower faces (shared with neighbours), meets no other leaf.
  const auto inside = [&](const GridPoint& p) {
    return (p.array() > tile_cell.lo.array()).all() && (p.array() <= tile_cell.hi.array()).all();
  };
  if (!tile.isLong() && inside(a) && inside(b)) {
    want(tile.id(), true);
  } else if (isShort(tile.isLong(), a, b)) {
    const std::uint32_t owner = met.size() == 1 ? met[0] : partition->home(midpoint(a, b));
    for (const std::uint32_t leaf : met) want(tile_of[leaf], leaf == owner);
  } else {
    const std::uint32_t home_a = partition->home(a), home_b = partition->home(b);
    want(tile_of[home_a], false);
    if (home_b != home_a) want(tile_of[home_b], false);
    want(set.long_tile(), true);
  }

  const Vector3d a_W = set.grid().toWorld(a), b_W = set.grid().toWorld(b);
  if (!landmark_grid->covers(a_W) || !landmark_grid->covers(b_W) || !landmark_grid->covers((a_W + b_W) / 2))
    problem(nameOf(id) + ": farther from every landmark than the covering radius");
  if (maybe_landmark[landmarkSlot(id)]) checkLandmark(id, a_W, b_W);
}

// Every sample must be at home in exactly one tile.
void DeepCheck::Impl::nodes(const Tile& tile) {
  for (std::uint32_t n = 0; n < tile.node_count(); ++n) {
    if (!tile.isHome(n)) continue;
    const NodeId id = tile.nodeId(n);
    if (id.cell >= cells.size() || id.sample >= set.cell(id.cell).samples) continue;  // already reported
    if (at_home->set(sampleAt(id.cell, id.sample)))
      problem("tile " + std::to_string(tile.id()) + ": cell " + std::to_string(id.cell) + ": sample " +
              std::to_string(id.sample) + " is in two places");
    cells[id.cell].bounds.extend(tile.gridPoint(n));
  }
}

void DeepCheck::tile(const Tile& tile, const TileAppearance& appearance) {
  Impl& d = *impl_;
  const std::string name = "tile " + std::to_string(tile.id());
  d.tile_cell = tile.key().box();
  std::size_t owned = 0;
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    const SegmentId id = tile.segmentId(s);
    const std::size_t look = owned;
    owned += tile.owned(s) ? 1 : 0;
    const std::uint32_t child = tile.nodeId(tile.child(s)).sample, parent = tile.nodeId(tile.parent(s)).sample;
    const bool known = id.cell < d.cells.size() && id.segment < d.segmentRanks(id.cell) &&
                       std::max(child, parent) < d.set.cell(id.cell).samples &&
                       (hasLoops(d.set.cell(id.cell)) || child == id.segment);
    if (!known) {
      d.problem(name + ": " + nameOf(id) + ": the segment or sample does not exist");
      continue;
    }
    const std::uint64_t ids = Hash().add(id.key()).add(tile.owned(s)).value();
    d.found[tile.id()].add({ids, Hash()
                                     .add(ids)
                                     .add(child)
                                     .add(parent)
                                     .add(tile.gridPoint(tile.child(s)))
                                     .add(tile.gridPoint(tile.parent(s)))
                                     .value()});
    if (tile.owned(s)) d.own(tile, s, appearance.radii_um[look], appearance.types[look]);
  }
  if (!tile.isLong()) d.nodes(tile);

  const TileEntry entry = entryOf(tile), &stated = d.set.entry(tile.id());
  if (entry.owned != stated.owned || entry.stored != stated.stored || entry.isolated != stated.isolated ||
      entry.decoded_bytes != stated.decoded_bytes)
    d.entry_faults[tile.id()] |= Impl::kWrongCounts;
  if (entry.content.lo != stated.content.lo || entry.content.hi != stated.content.hi)
    d.entry_faults[tile.id()] |= Impl::kWrongBox;
}

void DeepCheck::Impl::checkCell(std::uint32_t c) {
  const CellRecord& stated = set.cell(c);
  const CellSums& sums = cells[c];
  const CellDetail detail = set.loadCellDetail(c);
  const std::string name = "cell " + std::to_string(c);
  if (stated.removed) {
    require(sums.segments == 0 && sums.isolated == 0 && detail.tiles.empty(), name + ": is removed but has segments");
    return;
  }
  require(set.findCell(stated.name) == c, name + ": is not found by its name");
  if (c > 0 && !set.grown()) require(set.cell(c - 1).source <= stated.source, name + ": its source is out of order");
  require(sums.segments == stated.segments && sums.isolated == stated.isolated, name + ": its counts are wrong");
  require(sums.bounds.lo == stated.bounds.lo && sums.bounds.hi == stated.bounds.hi, name + ": its bounds are wrong");
  std::uint64_t tiles = 0;
  for (const TileId t : detail.tiles) tiles += Hash().add(t).value();
  require(tiles == sums.tiles && detail.tiles.size() == sums.tile_count, name + ": its list of tiles is wrong");

  std::uint64_t attributes = 0;
  std::size_t root = 0;
  const bool loops = hasLoops(stated);
  for (std::uint32_t i = 0; i < stated.samples; ++i) {
    const auto sample = [&] { return name + ", sample " + std::to_string(i); };
    const std::uint64_t at = sampleAt(c, i);
    const bool is_root = root < detail.roots.size() && detail.roots[root].rank == i;
    if (!(*at_home)[at]) problem(sample() + ": in no tile");
    if (is_root == (*is_child)[at])
      problem(sample() + (is_root ? ": is a root with a parent" : ": its segment has no owner"));
    if (is_root && !(*is_linked)[at])
      attributes += Hash()
                        .add(i)
                        .add(std::bit_cast<std::uint32_t>(detail.roots[root].radius_um))
                        .add(detail.roots[root].type)
                        .value();
    root += is_root;
  }
  require(root == detail.roots.size() && root == stated.roots, name + ": its list of roots is wrong");
  require(attributes == sums.attributes, name + ": radii or types of isolated samples differ from those of its roots");
  for (std::uint32_t s = 0; loops && s < segmentRanks(c); ++s)
    if (!(*owned)[segment_begin[c] + s]) problem(nameOf({c, s}) + ": has no owner");
  if (detail.odd_radii.empty()) return;
  try {
    readCell(set, c, true);  // compares odd radii with those in the tiles
  } catch (const CorruptSet& error) {
    problem(error.what());
  }
}

void DeepCheck::finish() {
  Impl& d = *impl_;
  for (TileId t = 0; t < d.wanted.size(); ++t) {
    const std::string name = "tile " + std::to_string(t);
    const auto &want = d.wanted[t], &found = d.found[t];
    if (want.ids != found.ids) {
      d.problem(name + ": does not hold the segments that meet its block");
    } else if (want.geometry != found.geometry) {
      d.problem(name + ": a sample of its segments is in two places: here and at the segments' owner");
    }
    if (want != found) continue;
    if (d.entry_faults[t] & Impl::kWrongCounts) d.problem(name + ": the directory's counts are wrong");
    if (d.entry_faults[t] & Impl::kWrongBox) d.problem(name + ": the directory's box is wrong");
    const TypeMask stated = d.set.entry(t).types;
    // A grown set may state more types than its tiles hold.
    if (d.set.format() > 2 && (d.set.grown() ? (stated & d.types[t]) != d.types[t] : stated != d.types[t]))
      d.problem(name + ": the directory's types are wrong");
  }
  SetCounts sum = d.set.counts();
  sum.samples = sum.segments = sum.isolated = sum.roots = 0;
  GridBox bounds;
  for (std::uint32_t c = 0; c < d.cells.size(); ++c) {
    d.checkCell(c);
    const CellRecord& record = d.set.cell(c);
    bounds.extend(d.cells[c].bounds);
    sum.samples += record.samples, sum.segments += record.segments;
    sum.isolated += record.isolated, sum.roots += record.roots;
  }
  d.require(sum == d.set.counts(), "the manifest's counts are wrong");
  d.require(
      (bounds.empty() && d.set.bounds().empty()) || (bounds.lo == d.set.bounds().lo && bounds.hi == d.set.bounds().hi),
      "the manifest's bounds are wrong");
  std::vector<std::uint32_t> lost;
  for (const auto& [segment, point] : d.landmarks_on) lost.push_back(point);
  std::sort(lost.begin(), lost.end());
  for (const std::uint32_t point : lost)
    d.problem("landmark " + std::to_string(point) + ": the segment does not exist");
}

}  // namespace filiform::internal
