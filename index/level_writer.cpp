#include "index/level_writer.h"

#include "index/errors.h"
#include "index/internal/level_files.h"
#include "index/internal/output_file.h"
#include "index/internal/set_files.h"
#include "index/tile_codec.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <exception>
#include <system_error>
#include <thread>

namespace filiform {
namespace {

constexpr int kOctree = 3;               // binary splits
constexpr double kToleranceParts = 512;  // of the edge
constexpr double kMostTolerance = 8;     // times the tolerance
constexpr std::size_t kUnitLeaves = 64;  // worked on by one thread
constexpr int kRadiusBits = 4;           // of the mantissa: 3 % off at most

struct MadeTile {
  LevelEntry entry;
  std::vector<std::uint8_t> geometry, appearance;
};

// The least cell of the octree that holds leaves [begin, end), two at least.
CellKey commonCell(std::span<const CellKey> leaves, std::size_t begin, std::size_t end) {
  const MortonKey differ = leaves[begin].low ^ leaves[end - 1].low;
  const auto high = static_cast<std::uint64_t>(differ >> 64), low = static_cast<std::uint64_t>(differ);
  const int zeros = high != 0 ? std::countl_zero(high) : 64 + std::countl_zero(low);
  const int common = std::max(0, zeros - (128 - kMortonBits));
  const int depth = common / kOctree * kOctree;
  const MortonKey mask = ~((MortonKey{1} << (kMortonBits - depth)) - 1);
  return {leaves[begin].low & mask, depth};
}

// The end of the part of [begin, end) that lies with leaf `begin` in one cell of the next octree level below `depth`.
std::size_t groupEnd(std::span<const CellKey> leaves, std::size_t begin, std::size_t end, int depth) {
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

MadeTile encode(const ThreadGraph& graph, const CellKey& key, const Grid& grid) {
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
  for (const ThreadShare& share : graph.shares) made.entry.represented += share.segments;
  made.entry.dropped = graph.dropped;
  made.entry.dropped_um = graph.dropped_um;
  const Tile tile(0, key, true, grid, std::move(segments));
  made.entry.decoded_bytes = tile.bytes();
  made.geometry = encodeTile(tile);
  made.appearance = encodeAppearance(appearance);
  return made;
}

// Walks the octree bottom-up; what it makes comes out in that order.
class Maker {
 public:
  Maker(const LevelInput& input, const LevelOptions& options) : input_(input), options_(options) {}
  virtual ~Maker() = default;
  Maker(const Maker&) = delete;
  Maker& operator=(const Maker&) = delete;

  ThreadGraph make(std::size_t begin, std::size_t end) {
    if (end - begin == 1) return leaf(begin);
    const CellKey cell = commonCell(input_.leaves, begin, end);
    std::vector<ThreadGraph> parts;
    for (std::size_t at = begin; at < end;) {
      const std::size_t next = groupEnd(input_.leaves, at, end, cell.depth);
      parts.push_back(part(at, next));
      at = next;
    }
    const ThreadGraph all = join(std::move(parts));
    GridBox box;
    for (const ThreadNode& n : all.nodes) box.extend(n.p);
    const std::uint64_t extent =
        box.empty()
            ? 1
            : std::bit_ceil(static_cast<std::uint64_t>(std::max<std::int64_t>(1, (box.hi - box.lo).maxCoeff())));
    const std::uint64_t edge = std::uint64_t{1} << (kMortonAxisBits - cell.depth / kOctree);
    SimplifyOptions simplest;
    simplest.tolerance_um = static_cast<double>(std::min(extent, edge)) * input_.grid.quantum_um() / kToleranceParts;
    simplest.most_tolerance_um = kMostTolerance * simplest.tolerance_um;
    simplest.most_segments = options_.most_segments;
    ThreadGraph graph = simplify(all, input_.grid, simplest);
    emit(encode(graph, cell, input_.grid));
    return graph;
  }

 protected:
  virtual ThreadGraph part(std::size_t begin, std::size_t end) { return make(begin, end); }
  virtual void emit(MadeTile tile) = 0;
  ThreadGraph leaf(std::size_t at) const {
    const auto tile = static_cast<TileId>(at);
    return threadsOf(*input_.load(tile), input_.loadAppearance(tile), input_.grid);
  }

  const LevelInput& input_;
  const LevelOptions& options_;
};

class UnitMaker final : public Maker {
 public:
  using Maker::Maker;
  std::vector<MadeTile> tiles;

 private:
  void emit(MadeTile tile) override { tiles.push_back(std::move(tile)); }
};

struct Unit {
  std::size_t begin, end;
  ThreadGraph graph;
  std::vector<MadeTile> tiles;
};

// The top of the octree on the calling thread, what lies below in units, some at a time on all threads.
class TopMaker final : public Maker {
 public:
  TopMaker(const LevelInput& input, const LevelOptions& options, std::function<void(MadeTile)> write)
      : Maker(input, options), write_(std::move(write)) {
    if (!input.leaves.empty()) listUnits(0, input.leaves.size());
  }

  void run() {
    if (units_.empty()) return;
    ThreadGraph whole = part(0, input_.leaves.size());
  }

 private:
  bool isUnit(std::size_t begin, std::size_t end) const { return end - begin <= kUnitLeaves; }
  void listUnits(std::size_t begin, std::size_t end) {
    if (isUnit(begin, end)) {
      units_.push_back({begin, end, {}, {}});
      return;
    }
    const CellKey cell = commonCell(input_.leaves, begin, end);
    for (std::size_t at = begin; at < end;) {
      const std::size_t next = groupEnd(input_.leaves, at, end, cell.depth);
      listUnits(at, next);
      at = next;
    }
  }

  ThreadGraph part(std::size_t begin, std::size_t end) override {
    if (!isUnit(begin, end)) return make(begin, end);
    if (taken_ == made_) makeSome();
    Unit& unit = units_[taken_++];
    for (MadeTile& tile : unit.tiles) write_(std::move(tile));
    unit.tiles = {};
    if (input_.progress) input_.progress(unit.end);
    return std::move(unit.graph);
  }
  void emit(MadeTile tile) override { write_(std::move(tile)); }

  void makeSome() {
    const std::size_t threads = std::max(1u, options_.threads), first = made_;
    const std::size_t last = std::min(units_.size(), first + 4 * threads);
    std::atomic<std::size_t> next{first};
    const auto work = [&](std::exception_ptr& failure) {
      try {
        for (std::size_t i; (i = next.fetch_add(1)) < last;) {
          UnitMaker maker(input_, options_);
          units_[i].graph = maker.make(units_[i].begin, units_[i].end);
          units_[i].tiles = std::move(maker.tiles);
        }
      } catch (...) {
        failure = std::current_exception();
      }
    };
    const std::size_t helpers = std::min(threads, last - first) - 1;
    std::vector<std::exception_ptr> failures(helpers + 1);
    {
      std::vector<std::jthread> pool;
      try {
        for (std::size_t i = 0; i < helpers; ++i) pool.emplace_back(work, std::ref(failures[i]));
      } catch (const std::system_error&) {
        // No more threads are to be had: those that there are do the work.
      }
      work(failures[helpers]);
    }
    for (const std::exception_ptr& failure : failures)
      if (failure) std::rethrow_exception(failure);
    made_ = last;
  }

  std::function<void(MadeTile)> write_;
  std::vector<Unit> units_;
  std::size_t taken_ = 0, made_ = 0;
};

}  // namespace

std::vector<SetFile> writeLevels(const LevelInput& input, const LevelOptions& options, const std::string& folder) {
  std::vector<SetFile> files;
  internal::LevelTable table;
  table.grid = input.grid;
  table.most_segments = options.most_segments;
  std::unique_ptr<internal::OutputFile> pack;
  std::uint32_t packs = 0;
  const auto close = [&](const std::string& name, internal::OutputFile& file) {
    file.close();
    files.push_back({name, file.bytes(), file.digest()});
  };

  TopMaker maker(input, options, [&](MadeTile made) {
    const std::uint64_t bytes = made.geometry.size() + made.appearance.size();
    if (pack != nullptr && pack->bytes() + bytes > options.pack_bytes) {
      close(internal::levelPackFile(packs - 1), *pack);
      pack.reset();
    }
    if (pack == nullptr) {
      pack = std::make_unique<internal::OutputFile>(folder + "/" + internal::levelPackFile(packs));
      pack->write(internal::levelPackHeader(packs++));
    }
    if (made.geometry.size() > UINT32_MAX || made.appearance.size() > UINT32_MAX)
      throw InputError("a tile of a level of detail takes more than 4 GiB");
    internal::TileLocation at;
    at.pack = packs - 1;
    at.offset = pack->bytes();
    at.geometry_bytes = static_cast<std::uint32_t>(made.geometry.size());
    at.appearance_bytes = static_cast<std::uint32_t>(made.appearance.size());
    at.geometry_checksum = internal::checksum(made.geometry);
    at.appearance_checksum = internal::checksum(made.appearance);
    pack->write(made.geometry);
    pack->write(made.appearance);
    table.entries.push_back(made.entry);
    table.locations.push_back(at);
  });
  maker.run();
  if (pack != nullptr) close(internal::levelPackFile(packs - 1), *pack);

  std::vector<std::uint32_t> order(table.entries.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const CellKey &x = table.entries[a].key, &y = table.entries[b].key;
    return x.low != y.low ? x.low < y.low : x.depth < y.depth;
  });
  internal::LevelTable sorted;
  sorted.grid = table.grid;
  sorted.most_segments = table.most_segments;
  for (const std::uint32_t i : order) {
    sorted.entries.push_back(table.entries[i]);
    sorted.locations.push_back(table.locations[i]);
  }
  internal::OutputFile file(folder + "/" + internal::kLevelsFile);
  file.write(internal::encodeLevels(sorted));
  close(internal::kLevelsFile, file);
  return files;
}

}  // namespace filiform
