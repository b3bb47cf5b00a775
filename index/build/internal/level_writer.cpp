#include "index/build/internal/level_writer.h"

#include "index/build/internal/level_blocks.h"
#include "index/build/internal/level_somata.h"
#include "index/build/internal/level_tile.h"
#include "index/build/internal/memory_budget.h"
#include "index/build/internal/pack_writer.h"
#include "index/errors.h"
#include "index/file/internal/output_file.h"
#include "index/file/internal/spool.h"
#include "index/set/internal/level_files.h"
#include "index/workers.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <utility>

namespace filiform {
namespace {

using internal::BeyondBudget;
using internal::LeafRange;
using internal::LevelBlocks;
using internal::LevelTile;
using internal::MemoryBudget;

constexpr double kLayers = 5;  // segments are hidden if neurites cover a block's pixels so many times
// A level tile has so many times fewer segments than the tiles below it, in full resolution or of a level.
constexpr std::uint64_t kFewerThanAll = 5, kFewerThanLevel = 3;
constexpr double kStep = 1.5;        // between tiles of the outermost block
constexpr double kFewestParts = 16;  // of its coarsest tile
constexpr std::size_t kFewSegments = 256;
constexpr std::size_t kUnitLeaves = 512;       // for one thread, unless a block with a level has more
constexpr std::size_t kUnitsOfThread = 8;      // until all threads wait for each other
constexpr std::size_t kKeptPoints = 1U << 14;  // of a block; more go to the spool until the block above is made
constexpr std::size_t kMostPoints = 1U << 18;  // of the parts of a block without a level
constexpr std::size_t kSpoolBlock = std::size_t{64} << 10;

// What a step takes, bytes.
constexpr std::uint64_t kBytesOfPoint = 80, kBytesOfLinked = 144;  // a point with its part of a path, and if linked
// A point while its tile is made: up to 54 bytes of neurites and 138 of tile and bytes, measured, and a quarter more.
constexpr std::uint64_t kBytesOfMade = 240;
constexpr std::uint64_t kBytesOfMasks = std::uint64_t{4} << 20;

std::uint64_t bytesOf(const Neurites& neurites) {
  return neurites.points.capacity() * sizeof(NeuritePoint) + neurites.paths.capacity() * sizeof(NeuritePath);
}

// A leaf whose neurites are still to be read, or the neurites of a block, in memory or in the spool.
struct Piece {
  std::optional<TileId> leaf;
  Neurites neurites;
  MemoryBudget::Hold hold;
  std::optional<internal::ByteChain> spooled;
};

// The pieces of a block, in the order of their keys.
struct Content {
  std::vector<Piece> pieces;
  std::uint64_t points = 0;
  std::uint64_t finer = 0;  // segments of the finest tiles, of a level or in full resolution, that show the same
};

bool onlyLeaves(const Content& content) {
  return std::all_of(content.pieces.begin(), content.pieces.end(),
                     [](const Piece& piece) { return piece.leaf.has_value(); });
}

// How many times neurites would cover the smallest side of their box with lines of one pixel.
double layersOf(const Neurites& neurites, const GridBox& box, const Grid& grid, double pixel_um) {
  const Vector3d size = (box.hi - box.lo).cast<double>();
  const double least_area = std::min({size.x() * size.y(), size.y() * size.z(), size.z() * size.x()});
  double length = 0;
  for (const NeuritePath& path : neurites.paths)
    for (std::uint32_t k = 1; k < path.count; ++k)
      length += (neurites.points[path.begin + k].p - neurites.points[path.begin + k - 1].p).cast<double>().norm();
  return least_area > 0 ? length * pixel_um / grid.quantum_um() / least_area : 0;
}

struct Coarsening {
  bool simplifying = true, every_cell = true;  // simplify() before hide(); hide() keeps a segment of every cell
};

// Simplifies the content of a block to 1 / parts of its extent.
void coarsen(Neurites& neurites, const Grid& grid, const BlockKey& block, double parts, const Coarsening& how) {
  constexpr double kMostPixels = 2048, kLeast = 0.25;  // of the extent of the content; of the tolerance
  GridBox box;
  for (const NeuritePoint& point : neurites.points) box.extend(point.p);
  const double unit_um = internal::extentOf_um(block, box, grid) / parts;
  if (unit_um <= 0) return;
  const double pixel_um =
      std::max(unit_um, (box.hi - box.lo).cast<double>().maxCoeff() * grid.quantum_um() / kMostPixels);
  const bool overlaps = layersOf(neurites, box, grid, pixel_um) > kLayers;
  if (how.simplifying) simplify(neurites, grid, std::max(kLeast * unit_um, unit_um - neurites.error_um));
  if (overlaps) hide(neurites, grid, pixel_um, how.every_cell);
}

// The neurites of the block at work. A thread uses the same memory for one block after another: the system takes long
// to give it anew. Thread rule: of one thread.
class BlockWork {
 public:
  explicit BlockWork(MemoryBudget& budget) : budget_(budget), hold_(budget, 0) {}

  Neurites neurites;

  std::uint64_t bytes() const { return hold_.bytes(); }
  // Clears it for a block of `points`, and holds the memory for its work. Throws BeyondBudget.
  void begin(std::uint64_t points, std::uint64_t work_bytes) {
    constexpr std::uint64_t kMostTimes = 4;
    if (hold_.bytes() > kMostTimes * work_bytes) end();
    Neurites empty;
    empty.paths = std::move(neurites.paths);
    empty.points = std::move(neurites.points);
    empty.paths.clear();
    empty.points.clear();
    neurites = std::move(empty);
    if (hold_.bytes() < work_bytes) hold_.change(work_bytes);
    neurites.points.reserve(points + points / 16);
  }
  // Holds the memory for a tile of what is left of the neurites. Throws BeyondBudget.
  void beginTile() { hold_.change(bytesOf(neurites) + neurites.points.size() * kBytesOfMade); }
  // Returns all memory.
  void end() {
    neurites = {};
    hold_ = MemoryBudget::Hold(budget_, 0);
  }

 private:
  MemoryBudget& budget_;
  MemoryBudget::Hold hold_;
};

// Walks the octree bottom-up; what it makes comes out in that order. Throws BeyondBudget.
class Maker {
 public:
  Maker(const LevelInput& input, const LevelBlocks& blocks, const internal::LevelSomata& somata, MemoryBudget& budget,
        internal::Spool& spool, BlockWork& work)
      : input_(input), blocks_(blocks), somata_(somata), budget_(budget), spool_(spool), work_(work) {}
  virtual ~Maker() = default;
  Maker(const Maker&) = delete;
  Maker& operator=(const Maker&) = delete;

  Content make(const LeafRange& range) {
    if (range.end - range.begin == 1) return leaf(range);
    const BlockKey block = blocks_.block(range);
    Content content;
    for (std::size_t at = range.begin; at < range.end;) {
      const LeafRange inside = blocks_.part(at, range.end, block.depth);
      Content part_of = part(inside);
      std::move(part_of.pieces.begin(), part_of.pieces.end(), std::back_inserter(content.pieces));
      content.points += part_of.points;
      content.finer += part_of.finer;
      at = inside.end;
    }
    const bool has_level = blocks_.hasLevel(range, block);
    // Parts that are coarser than leaves are reduced on the way up, so that memory does not grow with the set.
    const bool crowded = !onlyLeaves(content) && content.points > kMostPoints;
    return has_level || crowded ? coarsened(range, block, std::move(content), has_level) : std::move(content);
  }

 protected:
  virtual Content part(const LeafRange& range) { return make(range); }
  virtual void emit(LevelTile tile) = 0;

  const LevelInput& input_;
  const LevelBlocks& blocks_;
  const internal::LevelSomata& somata_;
  MemoryBudget& budget_;
  internal::Spool& spool_;
  BlockWork& work_;

 private:
  Content leaf(const LeafRange& range) const {
    const auto tile = static_cast<TileId>(range.begin);
    Content content;
    content.pieces.emplace_back().leaf = tile;
    content.points = input_.points(tile);
    content.finer = blocks_.segments(range);
    return content;
  }

  Content coarsened(const LeafRange& range, const BlockKey& block, Content content, bool has_level) {
    Content made;
    const bool outermost = blocks_.isOutermost(range), first = content.finer == blocks_.segments(range);
    const double parts = first ? internal::kFirstParts : internal::kParts;
    const bool linking = outermost || !onlyLeaves(content);
    work_.begin(content.points, content.points * (linking ? kBytesOfLinked : kBytesOfPoint) + kBytesOfMasks);
    Neurites& neurites = work_.neurites;
    gather(std::move(content.pieces), neurites);
    internal::removeInsideBalls(neurites, input_.grid);
    // Leaves are as coarse as a first level. Joining them would change little, and takes long.
    if (linking) neurites = linked(std::move(neurites));
    coarsen(neurites, input_.grid, block, parts, {.simplifying = linking});
    const std::uint64_t most = content.finer / (first ? kFewerThanAll : kFewerThanLevel);
    const bool is_tile = outermost || (has_level && neurites.points.size() - neurites.paths.size() <= most);
    made.finer = content.finer;
    if (is_tile) {
      work_.beginTile();
      LevelTile tile = internal::encodeLevel(neurites, block, 0, input_.grid);
      made.finer = tile.entry.segments;
      emit(std::move(tile));
    }
    if (outermost)
      makeCoarser(neurites, block, parts / kStep);
    else
      keep(neurites, made);
    return made;
  }

  void gather(std::vector<Piece> pieces, Neurites& all) const {
    for (Piece& piece : pieces) {
      if (piece.leaf) {
        Neurites neurites = input_.neurites(*piece.leaf);
        somata_.apply(neurites, input_.leaves[*piece.leaf]);
        append(all, neurites);
      } else if (piece.spooled) {
        std::vector<std::uint8_t> bytes(piece.spooled->bytes());
        internal::ByteChain::Reader(*piece.spooled, true).read(bytes.data(), bytes.size());
        append(all, unpacked(bytes));
      } else {
        append(all, piece.neurites);
      }
      piece = {};
    }
  }

  // Keeps the neurites of a block for the block above.
  void keep(const Neurites& neurites, Content& content) {
    content.points = neurites.points.size();
    Piece& piece = content.pieces.emplace_back();
    if (content.points > kKeptPoints) {
      piece.spooled.emplace(spool_);
      piece.spooled->append(packed(neurites));
      piece.spooled->close();
    } else {
      piece.neurites = neurites;
      piece.hold = MemoryBudget::Hold(budget_, bytesOf(piece.neurites));
    }
  }

  // Further tiles of the outermost block, so that one of them fits every limit.
  void makeCoarser(Neurites& neurites, const BlockKey& block, double parts) {
    std::uint32_t coarser = 0;
    for (; parts >= kFewestParts && neurites.points.size() > kFewSegments; parts /= kStep) {
      coarsen(neurites, input_.grid, block, parts, {.every_cell = false});
      emit(internal::encodeLevel(neurites, block, ++coarser, input_.grid));
    }
  }
};

class UnitMaker final : public Maker {
 public:
  using Maker::Maker;
  std::vector<LevelTile> tiles;
  MemoryBudget::Hold tiles_hold{budget_, 0};

 private:
  void emit(LevelTile tile) override {
    tiles_hold.change(tiles_hold.bytes() + tile.bytes());
    tiles.push_back(std::move(tile));
  }
};

struct Unit {
  LeafRange range;
  Content content;
  std::vector<LevelTile> tiles;
  MemoryBudget::Hold tiles_hold;
  bool made = false;
};

// Makes the top of the octree on the calling thread; units below are made on all threads, some at a time.
class TopMaker final : public Maker {
 public:
  TopMaker(const LevelInput& input, const LevelBlocks& blocks, const internal::LevelSomata& somata,
           MemoryBudget& budget, internal::Spool& spool, unsigned threads, std::function<void(const LevelTile&)> write)
      : Maker(input, blocks, somata, budget, spool, own_work_),
        own_work_(budget),
        threads_(std::max(1u, threads)),
        write_(std::move(write)) {
    if (!input.leaves.empty()) listUnits({0, input.leaves.size()});
  }

  void run() {
    if (!units_.empty()) part({0, input_.leaves.size()});
  }

 private:
  // A block without levels inside is made at once: a large part of the work is there.
  bool isUnit(const LeafRange& range) const {
    if (range.end - range.begin <= kUnitLeaves) return true;
    return blocks_.hasLevel(range, blocks_.block(range)) && blocks_.isFirst(range);
  }
  void listUnits(const LeafRange& range) {
    if (isUnit(range)) {
      units_.push_back({range, {}, {}, {}});
      return;
    }
    const BlockKey block = blocks_.block(range);
    for (std::size_t at = range.begin; at < range.end;) {
      const LeafRange inside = blocks_.part(at, range.end, block.depth);
      listUnits(inside);
      at = inside.end;
    }
  }

  Content part(const LeafRange& range) override {
    if (taken_ >= units_.size() || units_[taken_].range.begin != range.begin || units_[taken_].range.end != range.end)
      return make(range);
    if (taken_ == claimed_) makeSome();
    Unit unit = std::move(units_[taken_++]);
    for (const LevelTile& tile : unit.tiles) write_(tile);
    if (input_.progress) input_.progress(unit.range.end);
    return std::move(unit.content);
  }
  void emit(LevelTile tile) override { write_(tile); }

  void makeUnit(Unit& unit, BlockWork& work) const {
    UnitMaker maker(input_, blocks_, somata_, budget_, spool_, work);
    unit.content = maker.make(unit.range);
    unit.tiles = std::move(maker.tiles);
    unit.tiles_hold = std::move(maker.tiles_hold);
    unit.made = true;
  }

  // A unit that does not fit beside others is made alone: those before it are taken first, those after it made again.
  void makeSome() {
    const std::size_t first = claimed_;
    const std::size_t last = std::min<std::size_t>(units_.size(), first + kUnitsOfThread * threads_);
    own_work_.end();
    const std::uint64_t used_before = budget_.used();
    std::atomic<std::size_t> next{first};
    runWorkers(std::min<std::size_t>(threads_, last - first), [&](unsigned, const std::atomic<bool>& failed) {
      BlockWork work(budget_);
      while (!failed) {
        const std::uint64_t used = budget_.used() - work.bytes();
        if (next > first && used > used_before && used - used_before > budget_.limit() / 2) break;
        const std::size_t i = next.fetch_add(1);
        if (i >= last) break;
        try {
          makeUnit(units_[i], work);
        } catch (const BeyondBudget&) {
        }
      }
    });
    const std::size_t end = std::min<std::size_t>(next, last);
    claimed_ = first;
    while (claimed_ < end && units_[claimed_].made) ++claimed_;
    for (std::size_t i = claimed_; i < end; ++i) {
      for (Piece& piece : units_[i].content.pieces)
        if (piece.spooled) piece.spooled->clear();
      units_[i] = {units_[i].range, {}, {}, {}};
    }
    if (claimed_ == first) makeUnit(units_[claimed_++], own_work_);
  }

  BlockWork own_work_;
  std::size_t threads_;
  std::function<void(const LevelTile&)> write_;
  std::vector<Unit> units_;
  std::size_t taken_ = 0, claimed_ = 0;
};

// The same tiles, in the order of the file.
internal::LevelTable sorted(const internal::LevelTable& table) {
  std::vector<std::uint32_t> order(table.entries.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return internal::comesBefore(table.entries[a], table.entries[b]);
  });
  internal::LevelTable all;
  all.grid = table.grid;
  all.least_segments = table.least_segments;
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
  table.least_segments = static_cast<std::uint32_t>(options.least_segments);
  internal::PackWriter packs(folder, {internal::levelPackFile, internal::levelPackHeader}, options.pack_bytes);
  constexpr std::uint64_t kSpoolPart = 8;
  MemoryBudget budget(options.memory - options.memory / kSpoolPart);
  internal::Spool spool(folder, kSpoolBlock, options.memory / kSpoolPart);
  const LevelBlocks blocks(input.leaves, input.segments, options.least_segments);
  const internal::LevelSomata somata(input.somata, input.grid);
  TopMaker maker(input, blocks, somata, budget, spool, options.threads, [&](const LevelTile& made) {
    table.locations.push_back(
        packs.add(made.geometry, made.appearance, "a tile of a level of detail takes more than 4 GiB"));
    table.entries.push_back(made.entry);
  });
  try {
    maker.run();
  } catch (const BeyondBudget& beyond) {
    const std::uint64_t bytes = beyond.bytes / (kSpoolPart - 1) * kSpoolPart + kSpoolPart;
    const std::uint64_t memory = options.memoryFor ? options.memoryFor(bytes) : bytes;
    throw InputError("the levels of detail take more memory than is given, more than " +
                     std::to_string((memory >> 20) + 1) + " MiB; ingest with a larger --memory, or with --no-levels");
  }
  std::vector<SetFile> files = packs.close();
  const internal::LevelTable all = sorted(table);
  internal::OutputFile file(folder + "/" + internal::kLevelsFile);
  file.write(internal::encodeLevels(all));
  file.close();
  files.push_back({internal::kLevelsFile, file.bytes(), file.digest()});
  return files;
}

}  // namespace filiform
