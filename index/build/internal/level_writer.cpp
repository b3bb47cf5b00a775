#include "index/build/internal/level_writer.h"

#include "index/build/internal/memory_budget.h"
#include "index/build/internal/pack_writer.h"
#include "index/errors.h"
#include "index/file/internal/output_file.h"
#include "index/set/internal/level_files.h"
#include "index/tile/tile_codec.h"
#include "index/workers.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

namespace filiform {
namespace {

constexpr int kOctree = 3;               // binary splits
constexpr double kToleranceParts = 512;  // of the edge
constexpr double kMostTolerance = 8;     // times the tolerance
constexpr std::size_t kUnitLeaves = 64;  // for one thread
constexpr int kRadiusBits = 4;           // of the mantissa: an error of at most 3 %

// What a step takes, bytes.
constexpr std::uint64_t kBytesOfLoaded = 260;                            // a segment of a tile, its graph included
constexpr std::uint64_t kBytesOfJoinedNode = 270, kBytesOfJoined = 310;  // while graphs are joined and made simpler
constexpr std::uint64_t kBytesOfMadeNode = 80, kBytesOfMade = 540;       // while a graph is made into a tile
constexpr std::uint64_t kBytesOfShare = 3 * sizeof(NeuriteShare);

using internal::BeyondBudget;
using internal::MemoryBudget;

struct MadeTile {
  LevelEntry entry;
  std::vector<std::uint8_t> geometry, appearance;

  std::uint64_t bytes() const { return sizeof *this + geometry.capacity() + appearance.capacity(); }
};

struct HeldGraph {
  NeuriteGraph graph;
  MemoryBudget::Hold hold;
};

std::uint64_t bytesOf(const NeuriteGraph& graph) {
  return graph.nodes.capacity() * sizeof(NeuriteNode) + graph.segments.capacity() * sizeof(NeuriteSegment) +
         graph.shares.capacity() * sizeof(NeuriteShare);
}

// The smallest octree block that contains leaves [begin, end), at least two.
BlockKey commonBlock(std::span<const BlockKey> leaves, std::size_t begin, std::size_t end) {
  const MortonKey differ = leaves[begin].low ^ leaves[end - 1].low;
  const auto high = static_cast<std::uint64_t>(differ >> 64), low = static_cast<std::uint64_t>(differ);
  const int zeros = high != 0 ? std::countl_zero(high) : 64 + std::countl_zero(low);
  const int common = std::max(0, zeros - (128 - kMortonBits));
  const int depth = common / kOctree * kOctree;
  const MortonKey mask = ~((MortonKey{1} << (kMortonBits - depth)) - 1);
  return {leaves[begin].low & mask, depth};
}

// The end of those leaves of [begin, end) that lie with leaf `begin` in one block of the next octree level below
// `depth`.
std::size_t groupEnd(std::span<const BlockKey> leaves, std::size_t begin, std::size_t end, int depth) {
  if (leaves[begin].depth < depth + kOctree) return begin + 1;
  const int shift = kMortonBits - depth - kOctree;
  std::size_t at = begin + 1;
  while (at < end && leaves[at].low >> shift == leaves[begin].low >> shift) ++at;
  return at;
}

float coarseRadius(float radius_um) {
  if (!std::isfinite(radius_um) || radius_um == 0) return radius_um;
  int exponent = 0;
  const float fraction = std::frexp(radius_um, &exponent);
  return std::ldexp(std::round(std::ldexp(fraction, kRadiusBits + 1)), exponent - kRadiusBits - 1);
}

MadeTile encode(const NeuriteGraph& graph, const BlockKey& key, const Grid& grid) {
  MadeTile made;
  TileAppearance appearance;
  std::vector<StoredSegment> segments = numbered(graph, appearance);
  for (float& radius : appearance.radii_um) radius = coarseRadius(radius);
  for (const StoredSegment& s : segments) {
    made.entry.content.extend(s.child);
    made.entry.content.extend(s.parent);
  }
  made.entry.key = key;
  made.entry.segments = static_cast<std::uint32_t>(segments.size());
  made.entry.error_um = errorOf(graph);
  for (const NeuriteShare& share : graph.shares) made.entry.represented += share.segments;
  made.entry.dropped = graph.dropped;
  made.entry.dropped_um = graph.dropped_um;
  const Tile tile(0, key, true, grid, std::move(segments));
  made.entry.decoded_bytes = tile.bytes();
  made.geometry = encodeTile(tile);
  made.appearance = encodeAppearance(appearance);
  return made;
}

// Walks the octree bottom-up; what it makes comes out in that order. Throws BeyondBudget.
class Maker {
 public:
  Maker(const LevelInput& input, const LevelOptions& options, MemoryBudget& budget)
      : input_(input), options_(options), budget_(budget) {}
  virtual ~Maker() = default;
  Maker(const Maker&) = delete;
  Maker& operator=(const Maker&) = delete;

  HeldGraph make(std::size_t begin, std::size_t end) {
    if (end - begin == 1) return leaf(begin);
    const BlockKey block = commonBlock(input_.leaves, begin, end);
    std::vector<HeldGraph> parts;
    std::uint64_t bytes = 0;
    for (std::size_t at = begin; at < end;) {
      const std::size_t next = groupEnd(input_.leaves, at, end, block.depth);
      parts.push_back(part(at, next));
      const NeuriteGraph& graph = parts.back().graph;
      bytes += graph.nodes.size() * kBytesOfJoinedNode + graph.segments.size() * kBytesOfJoined +
               graph.shares.size() * kBytesOfShare;
      at = next;
    }
    MemoryBudget::Hold work(budget_, bytes);
    HeldGraph made{simpler(std::move(parts), block), {}};
    made.hold = MemoryBudget::Hold(budget_, bytesOf(made.graph));
    work.change(made.graph.nodes.size() * kBytesOfMadeNode + made.graph.segments.size() * kBytesOfMade);
    emit(encode(made.graph, block, input_.grid));
    return made;
  }

 protected:
  virtual HeldGraph part(std::size_t begin, std::size_t end) { return make(begin, end); }
  virtual void emit(MadeTile tile) = 0;

  const LevelInput& input_;
  const LevelOptions& options_;
  MemoryBudget& budget_;

 private:
  HeldGraph leaf(std::size_t at) const {
    const auto tile = static_cast<TileId>(at);
    MemoryBudget::Hold hold(budget_, input_.stored(tile) * kBytesOfLoaded);
    NeuriteGraph graph = neuritesOf(*input_.load(tile), input_.loadAppearance(tile), input_.grid);
    hold.change(bytesOf(graph));
    return {std::move(graph), std::move(hold)};
  }

  NeuriteGraph simpler(std::vector<HeldGraph> parts, const BlockKey& block) const {
    std::vector<NeuriteGraph> graphs;
    for (HeldGraph& held : parts) graphs.push_back(std::move(held.graph));
    const NeuriteGraph all = join(std::move(graphs));
    parts.clear();
    GridBox box;
    for (const NeuriteNode& n : all.nodes) box.extend(n.p);
    const std::uint64_t extent =
        box.empty()
            ? 1
            : std::bit_ceil(static_cast<std::uint64_t>(std::max<std::int64_t>(1, (box.hi - box.lo).maxCoeff())));
    const std::uint64_t edge = std::uint64_t{1} << (kMortonAxisBits - block.depth / kOctree);
    SimplifyOptions simplest;
    simplest.tolerance_um = static_cast<double>(std::min(extent, edge)) * input_.grid.quantum_um() / kToleranceParts;
    simplest.most_tolerance_um = kMostTolerance * simplest.tolerance_um;
    simplest.most_segments = options_.most_segments;
    return simplify(all, input_.grid, simplest);
  }
};

class UnitMaker final : public Maker {
 public:
  using Maker::Maker;
  std::vector<MadeTile> tiles;
  MemoryBudget::Hold tiles_hold{budget_, 0};

 private:
  void emit(MadeTile tile) override {
    tiles_hold.change(tiles_hold.bytes() + tile.bytes());
    tiles.push_back(std::move(tile));
  }
};

struct Unit {
  std::size_t begin, end;
  HeldGraph graph;
  std::vector<MadeTile> tiles;
  MemoryBudget::Hold tiles_hold;
  bool made = false;
};

// Makes the top of the octree on the calling thread; units below are made on all threads, some at a time.
class TopMaker final : public Maker {
 public:
  TopMaker(const LevelInput& input, const LevelOptions& options, MemoryBudget& budget,
           std::function<void(const MadeTile&)> write)
      : Maker(input, options, budget), write_(std::move(write)) {
    if (!input.leaves.empty()) listUnits(0, input.leaves.size());
  }

  void run() {
    if (!units_.empty()) part(0, input_.leaves.size());
  }

 private:
  bool isUnit(std::size_t begin, std::size_t end) const { return end - begin <= kUnitLeaves; }
  void listUnits(std::size_t begin, std::size_t end) {
    if (isUnit(begin, end)) {
      units_.push_back({begin, end, {}, {}, {}});
      return;
    }
    const BlockKey block = commonBlock(input_.leaves, begin, end);
    for (std::size_t at = begin; at < end;) {
      const std::size_t next = groupEnd(input_.leaves, at, end, block.depth);
      listUnits(at, next);
      at = next;
    }
  }

  HeldGraph part(std::size_t begin, std::size_t end) override {
    if (!isUnit(begin, end)) return make(begin, end);
    if (taken_ == claimed_) makeSome();
    Unit unit = std::move(units_[taken_++]);
    for (const MadeTile& tile : unit.tiles) write_(tile);
    if (input_.progress) input_.progress(unit.end);
    return std::move(unit.graph);
  }
  void emit(MadeTile tile) override { write_(tile); }

  void makeUnit(Unit& unit) const {
    UnitMaker maker(input_, options_, budget_);
    unit.graph = maker.make(unit.begin, unit.end);
    unit.tiles = std::move(maker.tiles);
    unit.tiles_hold = std::move(maker.tiles_hold);
    unit.made = true;
  }

  // A unit that does not fit beside those of other threads is made when they are done.
  void makeSome() {
    const std::size_t threads = std::max(1u, options_.threads), first = claimed_;
    const std::size_t last = std::min(units_.size(), first + 4 * threads);
    const std::uint64_t used_before = budget_.used();
    std::atomic<std::size_t> next{first};
    runWorkers(std::min(threads, last - first), [&](unsigned, const std::atomic<bool>& failed) {
      while (!failed) {
        const std::uint64_t used = budget_.used();
        if (next > first && used > used_before && used - used_before > budget_.limit() / 2) break;
        const std::size_t i = next.fetch_add(1);
        if (i >= last) break;
        try {
          makeUnit(units_[i]);
        } catch (const BeyondBudget&) {
        }
      }
    });
    claimed_ = std::min<std::size_t>(next, last);
    for (std::size_t i = first; i < claimed_; ++i)
      if (!units_[i].made) makeUnit(units_[i]);
  }

  std::function<void(const MadeTile&)> write_;
  std::vector<Unit> units_;
  std::size_t taken_ = 0, claimed_ = 0;
};

// The same tiles, ascending by lowest key, a block before the blocks inside it.
internal::LevelTable sorted(internal::LevelTable table) {
  std::vector<std::uint32_t> order(table.entries.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const BlockKey &x = table.entries[a].key, &y = table.entries[b].key;
    return x.low != y.low ? x.low < y.low : x.depth < y.depth;
  });
  internal::LevelTable all;
  all.grid = table.grid;
  all.most_segments = table.most_segments;
  all.entries.reserve(order.size());
  all.locations.reserve(order.size());
  for (const std::uint32_t i : order) {
    all.entries.push_back(table.entries[i]);
    all.locations.push_back(table.locations[i]);
  }
  return all;
}

}  // namespace

std::vector<SetFile> writeLevels(const LevelInput& input, const LevelOptions& options, const std::string& folder) {
  internal::LevelTable table;
  table.grid = input.grid;
  table.most_segments = options.most_segments;
  internal::PackWriter packs(folder, {internal::levelPackFile, internal::levelPackHeader}, options.pack_bytes);
  internal::MemoryBudget budget(options.memory);
  TopMaker maker(input, options, budget, [&](const MadeTile& made) {
    table.locations.push_back(
        packs.add(made.geometry, made.appearance, "a tile of a level of detail takes more than 4 GiB"));
    table.entries.push_back(made.entry);
  });
  try {
    maker.run();
  } catch (const BeyondBudget& beyond) {
    const std::uint64_t memory = options.memoryFor ? options.memoryFor(beyond.bytes) : beyond.bytes;
    throw InputError("the levels of detail take more memory than is given; ingest without --levels, or with --memory " +
                     std::to_string((memory >> 20) + 1) + "MiB or more");
  }
  std::vector<SetFile> files = packs.close();
  const internal::LevelTable all = sorted(std::move(table));
  internal::OutputFile file(folder + "/" + internal::kLevelsFile);
  file.write(internal::encodeLevels(all));
  file.close();
  files.push_back({internal::kLevelsFile, file.bytes(), file.digest()});
  return files;
}

}  // namespace filiform
