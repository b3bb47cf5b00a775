#include "index/build/internal/level_writer.h"

#include "index/build/internal/memory_budget.h"
#include "index/build/internal/pack_writer.h"
#include "index/cell/soma.h"
#include "index/errors.h"
#include "index/file/internal/output_file.h"
#include "index/set/internal/level_files.h"
#include "index/tile/tile_codec.h"
#include "index/workers.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <tuple>

namespace filiform {
namespace {

constexpr int kOctree = 3;           // binary splits
constexpr int kStepBits = 6;         // between the blocks of level tiles
constexpr double kParts = 512;       // pixels and tolerances of a block's edge
constexpr double kLeafParts = 240;   // tolerances of a leaf's edge: finer than those of the block above
constexpr double kLayers = 5;        // segments are hidden if neurites cover a block's pixels so many times
constexpr double kFewerParts = 384;  // the same, of a block without level tiles below
// A level tile has so many times fewer segments than the tiles below it, in full resolution or of a level.
constexpr std::uint64_t kFewerThanAll = 4, kFewerThanLevel = 3;
constexpr double kStep = 1.5;        // between tiles of the outermost block
constexpr double kFewestParts = 16;  // of its coarsest tile
constexpr std::size_t kFewSegments = 256;
constexpr std::size_t kUnitLeaves = 512;  // for one thread
constexpr float kThickestBall_um = 30;    // a larger radius of a soma is an error
constexpr double kBallMargin = 1.02;      // a sample of a soma lies within this part of its radius
constexpr int kRadiusBits = 4;            // of the mantissa: an error of at most 3 %

// What a step takes, bytes.
constexpr std::uint64_t kBytesOfJoined = 3 * (sizeof(NeuritePoint) + sizeof(NeuritePath));  // a point
constexpr std::uint64_t kBytesOfMade = 540;  // a segment while it is made into a tile
constexpr std::uint64_t kBytesOfMasks = std::uint64_t{4} << 20;

using internal::BeyondBudget;
using internal::MemoryBudget;

struct MadeTile {
  LevelEntry entry;
  std::vector<std::uint8_t> geometry, appearance;

  std::uint64_t bytes() const { return sizeof *this + geometry.capacity() + appearance.capacity(); }
};

struct HeldNeurites {
  Neurites neurites;
  std::uint64_t finer = 0;  // segments of the finest tiles, of a level or in full resolution, that show the same
  MemoryBudget::Hold hold;
};

std::uint64_t bytesOf(const Neurites& neurites) {
  return neurites.points.capacity() * sizeof(NeuritePoint) + neurites.paths.capacity() * sizeof(NeuritePath);
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

// The grid of a tile: its quantum is at most 1 / 16 of the tolerance.
Grid coarseGrid(const Grid& grid, double tolerance_um) {
  constexpr double kPartsOfTolerance = 16;
  int exponent = grid.exponent();
  while (exponent < Grid::kMaxExponent && std::ldexp(kPartsOfTolerance, exponent + 1) <= tolerance_um) ++exponent;
  return Grid(exponent);
}

MadeTile encode(const Neurites& neurites, const BlockKey& key, std::uint32_t coarser, const Grid& fine) {
  MadeTile made;
  TileAppearance appearance;
  const Grid grid = coarseGrid(fine, std::max(neurites.error_um, neurites.pixel_um));
  const int shift = grid.exponent() - fine.exponent();
  const auto rounded = [&](const GridPoint& p) {
    GridPoint out;
    for (int axis = 0; axis < 3; ++axis) out[axis] = (p[axis] + (std::int64_t{1} << shift >> 1)) >> shift;
    return out;
  };
  std::vector<StoredSegment> segments = numbered(neurites, appearance);
  for (float& radius : appearance.radii_um) radius = coarseRadius(radius);
  for (StoredSegment& s : segments) {
    s.child = rounded(s.child);
    s.parent = rounded(s.parent);
    for (const GridPoint& p : {s.child, s.parent}) made.entry.content.extend(GridPoint(p * (std::int64_t{1} << shift)));
  }
  made.entry.key = key;
  made.entry.exponent = grid.exponent();
  made.entry.coarser = coarser;
  made.entry.segments = static_cast<std::uint32_t>(segments.size());
  constexpr double kHalfDiagonal = 0.8661;
  made.entry.error_um = neurites.error_um + (shift > 0 ? kHalfDiagonal * grid.quantum_um() : 0);
  made.entry.represented = neurites.represented;
  made.entry.hidden = neurites.hidden;
  made.entry.pixel_um = neurites.pixel_um;
  made.entry.hidden_um = neurites.hidden_um;
  const Tile tile(0, key, true, grid, std::move(segments));
  made.entry.decoded_bytes = tile.bytes();
  made.geometry = encodeTile(tile);
  made.appearance = encodeAppearance(appearance);
  return made;
}

// Extent of the content, um, and how many times it would cover the smallest side of its box with lines of one pixel.
struct Extent {
  double most_um = 0, least_area_um2 = 0, length_um = 0;

  Extent(const Neurites& neurites, const Grid& grid) {
    GridBox box;
    for (const NeuritePoint& point : neurites.points) box.extend(point.p);
    if (box.empty()) return;
    const Vector3d size = (box.hi - box.lo).cast<double>() * grid.quantum_um();
    most_um = size.maxCoeff();
    least_area_um2 = std::min({size.x() * size.y(), size.y() * size.z(), size.z() * size.x()});
    for (const NeuritePath& path : neurites.paths)
      for (std::uint32_t k = 1; k < path.count; ++k)
        length_um += (neurites.points[path.begin + k].p - neurites.points[path.begin + k - 1].p).cast<double>().norm() *
                     grid.quantum_um();
  }
  bool overlaps(double pixel_um) const { return length_um * pixel_um > kLayers * least_area_um2; }
};

// Simplifies within a total error of `tolerance_um`.
void simplifyTo(Neurites& neurites, const Grid& grid, double tolerance_um) {
  simplify(neurites, grid, std::max(0.0, tolerance_um - neurites.error_um));
}

// Walks the octree bottom-up; what it makes comes out in that order. Throws BeyondBudget.
class Maker {
 public:
  Maker(const LevelInput& input, const LevelOptions& options, MemoryBudget& budget)
      : input_(input), options_(options), budget_(budget) {}
  virtual ~Maker() = default;
  Maker(const Maker&) = delete;
  Maker& operator=(const Maker&) = delete;

  HeldNeurites make(std::size_t begin, std::size_t end) {
    if (end - begin == 1) return leaf(begin);
    const BlockKey block = commonBlock(input_.leaves, begin, end);
    std::vector<HeldNeurites> parts;
    std::uint64_t points = 0, segments = 0, finer = 0;
    for (std::size_t at = begin; at < end;) {
      const std::size_t next = groupEnd(input_.leaves, at, end, block.depth);
      parts.push_back(part(at, next));
      points += parts.back().neurites.points.size();
      segments += parts.back().neurites.represented + parts.back().neurites.hidden;
      finer += parts.back().finer;
      at = next;
    }
    const bool outermost = begin == 0 && end == input_.leaves.size();
    const bool coarser = outermost || (segments >= options_.least_segments && block.depth % kStepBits == 0);
    MemoryBudget::Hold work(budget_, points * kBytesOfJoined + (coarser ? kBytesOfMasks : 0));
    std::vector<Neurites> open;
    for (HeldNeurites& held : parts) open.push_back(std::move(held.neurites));
    HeldNeurites made{join(std::move(open)), finer, {}};
    parts.clear();
    if (coarser) removeInside(made.neurites, ballsOf(made.neurites));
    const std::uint64_t most = finer / (finer == segments ? kFewerThanAll : kFewerThanLevel);
    if (outermost || (coarser && finer != segments))
      coarsen(made.neurites, block, kParts, true);
    else if (coarser)
      coarsenFirst(made.neurites, block, most);
    made.hold = MemoryBudget::Hold(budget_, bytesOf(made.neurites));
    const bool is_tile = outermost || (coarser && made.neurites.points.size() <= most);
    work.change(is_tile ? made.neurites.points.size() * kBytesOfMade : 0);
    if (is_tile) {
      MadeTile tile = encode(made.neurites, block, 0, input_.grid);
      made.finer = tile.entry.segments;
      emit(std::move(tile));
    }
    if (outermost) makeCoarser(made.neurites, block);
    return made;
  }

 protected:
  virtual HeldNeurites part(std::size_t begin, std::size_t end) { return make(begin, end); }
  virtual void emit(MadeTile tile) = 0;

  const LevelInput& input_;
  const LevelOptions& options_;
  MemoryBudget& budget_;

 private:
  HeldNeurites leaf(std::size_t at) const {
    const auto tile = static_cast<TileId>(at);
    MemoryBudget::Hold hold(budget_, input_.bytes(tile));
    Neurites neurites = input_.neurites(tile);
    addSomata(neurites, input_.leaves[at]);
    hold.change(bytesOf(neurites));
    const std::uint64_t segments = neurites.represented;
    return {std::move(neurites), segments, std::move(hold)};
  }

  void addSomata(Neurites& neurites, const BlockKey& leaf) const {
    const auto first = std::lower_bound(input_.somata.begin(), input_.somata.end(), leaf.low,
                                        [](const SomaRoot& root, MortonKey low) { return mortonKey(root.p) < low; });
    std::vector<SomaRoot> here;
    for (auto root = first; root != input_.somata.end() && leaf.contains(mortonKey(root->p)); ++root)
      here.push_back(*root);
    if (here.empty()) return;
    std::sort(here.begin(), here.end(), [](const SomaRoot& a, const SomaRoot& b) {
      return std::tie(a.cell, a.sample) < std::tie(b.cell, b.sample);
    });
    removeInside(neurites, here, true);
    for (auto root = here.begin(); root != here.end(); ++root) {
      neurites.paths.push_back(
          {root->cell, root->sample, root->sample, kNoSample, static_cast<std::uint32_t>(neurites.points.size()), 1});
      neurites.points.push_back({root->p, root->radius_um, kSomaType, 0});
    }
  }

  // The somata among the balls, by cell.
  static std::vector<SomaRoot> ballsOf(const Neurites& neurites) {
    std::vector<SomaRoot> balls;
    for (const NeuritePath& path : neurites.paths)
      if (const NeuritePoint& point = neurites.points[path.begin]; path.isBall() && point.type == kSomaType)
        balls.push_back({path.cell, path.first_sample, point.p, point.radius_um});
    std::stable_sort(balls.begin(), balls.end(), [](const SomaRoot& a, const SomaRoot& b) { return a.cell < b.cell; });
    return balls;
  }

  // Removes the segments between samples of a soma, which its ball shows.
  void removeInside(Neurites& neurites, const std::vector<SomaRoot>& somata, bool isolated = false) const {
    std::vector<std::uint8_t> kept(neurites.points.size(), 1);
    bool any = false;
    for (const NeuritePath& path : neurites.paths) {
      auto soma = std::lower_bound(somata.begin(), somata.end(), path.cell,
                                   [](const SomaRoot& s, std::uint32_t cell) { return s.cell < cell; });
      for (; soma != somata.end() && soma->cell == path.cell; ++soma) {
        if (!(soma->radius_um <= kThickestBall_um)) continue;
        const auto isInside = [&](const NeuritePoint& point) {
          return (point.p - soma->p).cast<double>().norm() * input_.grid.quantum_um() <=
                 kBallMargin * static_cast<double>(soma->radius_um);
        };
        for (std::uint32_t k = path.isBall() && isolated ? 0 : 1; k < path.count; ++k) {
          const NeuritePoint* end = neurites.points.data() + path.begin + k;
          if (end->type != kSomaType || !isInside(*end) || !isInside(path.isBall() ? *end : end[-1])) continue;
          kept[path.begin + k] = 0;
          any = true;
        }
      }
    }
    if (any) cutOut(neurites, kept);
  }

  // Simplifies the content of a block to 1 / parts of its edge.
  void coarsen(Neurites& neurites, const BlockKey& block, double parts, bool hiding, bool every_cell = true) const {
    const Extent extent(neurites, input_.grid);
    const double edge_um = std::ldexp(input_.grid.quantum_um(), kMortonAxisBits - block.depth / kOctree);
    const double pixel_um = std::min(edge_um, extent.most_um) / parts;
    if (pixel_um <= 0) return;
    simplifyTo(neurites, input_.grid, pixel_um);
    if (hiding && extent.overlaps(pixel_um)) hide(neurites, input_.grid, pixel_um, every_cell);
  }

  // The same for a block without level tiles below. Hides only where that is needed for a tile, because it takes long.
  void coarsenFirst(Neurites& neurites, const BlockKey& block, std::uint64_t most) const {
    coarsen(neurites, block, kFewerParts, false);
    const std::size_t left = neurites.points.size();
    if (left > most && left <= 2 * most) coarsen(neurites, block, kFewerParts, true);
  }

  // Further tiles of the outermost block, so that one of them fits every limit.
  void makeCoarser(Neurites neurites, const BlockKey& block) {
    std::uint32_t coarser = 0;
    for (double parts = kParts / kStep; parts >= kFewestParts && neurites.points.size() > kFewSegments;
         parts /= kStep) {
      coarsen(neurites, block, parts, true, false);
      emit(encode(neurites, block, ++coarser, input_.grid));
    }
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
  HeldNeurites neurites;
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

  HeldNeurites part(std::size_t begin, std::size_t end) override {
    if (!isUnit(begin, end)) return make(begin, end);
    if (taken_ == claimed_) makeSome();
    Unit unit = std::move(units_[taken_++]);
    for (const MadeTile& tile : unit.tiles) write_(tile);
    if (input_.progress) input_.progress(unit.end);
    return std::move(unit.neurites);
  }
  void emit(MadeTile tile) override { write_(tile); }

  void makeUnit(Unit& unit) const {
    UnitMaker maker(input_, options_, budget_);
    unit.neurites = maker.make(unit.begin, unit.end);
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

// The same tiles, in the order of the file.
internal::LevelTable sorted(internal::LevelTable table) {
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

// The edge of a cube of the leaf's volume, or its content's extent if that is smaller.
void simplifyLeaf(Neurites& neurites, const BlockKey& leaf, const Grid& grid) {
  constexpr double kEdges[] = {1, 0.7937, 0.63};  // of the cube with the volume of a block that is halved 0 to 2 times
  const double edge_um =
      std::ldexp(grid.quantum_um() * kEdges[leaf.depth % kOctree], kMortonAxisBits - leaf.depth / kOctree);
  simplifyTo(neurites, grid, std::min(edge_um, Extent(neurites, grid).most_um) / kLeafParts);
}

}  // namespace

Neurites leafNeurites(std::span<const StoredSegment> segments, const TileAppearance& appearance, const BlockKey& leaf,
                      const Grid& grid) {
  Neurites neurites = neuritesOf(segments, appearance);
  simplifyLeaf(neurites, leaf, grid);
  return neurites;
}

Neurites leafNeurites(const Tile& tile, const TileAppearance& appearance) {
  Neurites neurites = neuritesOf(tile, appearance);
  simplifyLeaf(neurites, tile.key(), tile.grid());
  return neurites;
}

std::uint64_t neuriteBytes(std::uint64_t segments) {
  return segments * (2 * sizeof(NeuritePoint) + sizeof(NeuritePath));
}

std::vector<SetFile> writeLevels(const LevelInput& given, const LevelOptions& options, const std::string& folder) {
  internal::LevelTable table;
  LevelInput input = given;
  std::sort(input.somata.begin(), input.somata.end(), [](const SomaRoot& a, const SomaRoot& b) {
    const MortonKey x = mortonKey(a.p), y = mortonKey(b.p);
    return std::tie(x, a.cell, a.sample) < std::tie(y, b.cell, b.sample);
  });
  table.grid = input.grid;
  table.least_segments = static_cast<std::uint32_t>(options.least_segments);
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
    throw InputError("the levels of detail take more memory than is given, more than " +
                     std::to_string((memory >> 20) + 1) + " MiB; ingest with a larger --memory, or with --no-levels");
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
