#include "index/levels/internal/level_writer.h"

#include "index/errors.h"
#include "index/file/internal/output_file.h"
#include "index/file/internal/spool.h"
#include "index/levels/internal/level_files.h"
#include "index/levels/internal/level_maker.h"
#include "index/set/internal/pack_writer.h"
#include "index/workers.h"

#include <algorithm>
#include <atomic>
#include <utility>

namespace filiform {
namespace {

using internal::BeyondBudget;
using internal::BlockWork;
using internal::LeafRange;
using internal::LevelBlocks;
using internal::LevelContent;
using internal::LevelMaker;
using internal::LevelPiece;
using internal::LevelTile;
using internal::MemoryBudget;

constexpr std::size_t kMostUnitLeaves = 512;  // for one thread, unless a block with a level has more
constexpr std::size_t kUnitsOfThread = 8;     // until all threads wait for each other
constexpr std::size_t kSpoolBlock = std::size_t{64} << 10;

class UnitMaker final : public LevelMaker {
 public:
  using LevelMaker::LevelMaker;
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
  LevelContent content;
  std::vector<LevelTile> tiles;
  MemoryBudget::Hold tiles_hold;
  bool made = false;
};

// Makes the top of the octree on the calling thread; units below are made on all threads, some at a time.
class TopMaker final : public LevelMaker {
 public:
  TopMaker(const LevelInput& input, const LevelBlocks& blocks, const internal::LevelSomata& somata,
           MemoryBudget& budget, internal::Spool& spool, unsigned threads, std::function<void(const LevelTile&)> write)
      : LevelMaker(input, blocks, somata, budget, spool, own_work_),
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
    if (range.end - range.begin <= kMostUnitLeaves) return true;
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

  LevelContent part(const LeafRange& range) override {
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
      for (LevelPiece& piece : units_[i].content.pieces)
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
