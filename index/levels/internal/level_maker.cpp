#include "index/levels/internal/level_maker.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace filiform::internal {
namespace {

constexpr double kLayers = 5;  // segments are hidden if neurites cover a block's pixels so many times
// A level tile has so many times fewer segments than the tiles below it, in full resolution or of a level.
constexpr std::uint64_t kFewerThanAll = 5, kFewerThanLevel = 3;
constexpr double kStep = 1.5;        // between tiles of the outermost block
constexpr double kFewestParts = 16;  // of its coarsest tile
constexpr std::size_t kFewSegments = 256;
constexpr std::size_t kKeptPoints = 1U << 14;  // of a block; more go to the spool until the block above is made
constexpr std::size_t kMostPoints = 1U << 18;  // of the parts of a block without a level

// What a step takes, bytes.
constexpr std::uint64_t kBytesOfPoint = 80, kBytesOfLinked = 144;  // a point with its part of a path, and if linked
// A point while its tile is made: up to 54 bytes of neurites and 138 of tile and bytes, measured, and a quarter more.
constexpr std::uint64_t kBytesOfMade = 240;
constexpr std::uint64_t kBytesOfMasks = std::uint64_t{4} << 20;

std::uint64_t bytesOf(const Neurites& neurites) {
  return neurites.points.capacity() * sizeof(NeuritePoint) + neurites.paths.capacity() * sizeof(NeuritePath);
}

bool onlyLeaves(const LevelContent& content) {
  return std::all_of(content.pieces.begin(), content.pieces.end(),
                     [](const LevelPiece& piece) { return piece.leaf.has_value(); });
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
  const double unit_um = extentOf_um(block, box, grid) / parts;
  if (unit_um <= 0) return;
  const double pixel_um =
      std::max(unit_um, (box.hi - box.lo).cast<double>().maxCoeff() * grid.quantum_um() / kMostPixels);
  const bool overlaps = layersOf(neurites, box, grid, pixel_um) > kLayers;
  if (how.simplifying) simplify(neurites, grid, std::max(kLeast * unit_um, unit_um - neurites.error_um));
  if (overlaps) hide(neurites, grid, pixel_um, how.every_cell);
}

}  // namespace

void BlockWork::begin(std::uint64_t points, std::uint64_t work_bytes) {
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

void BlockWork::beginTile() { hold_.change(bytesOf(neurites) + neurites.points.size() * kBytesOfMade); }

void BlockWork::end() {
  neurites = {};
  hold_ = MemoryBudget::Hold(budget_, 0);
}

LevelContent LevelMaker::make(const LeafRange& range) {
  if (range.end - range.begin == 1) return leaf(range);
  const BlockKey block = blocks_.block(range);
  LevelContent content;
  for (std::size_t at = range.begin; at < range.end;) {
    const LeafRange inside = blocks_.part(at, range.end, block.depth);
    LevelContent part_of = part(inside);
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

LevelContent LevelMaker::leaf(const LeafRange& range) const {
  const auto tile = static_cast<TileId>(range.begin);
  LevelContent content;
  content.pieces.emplace_back().leaf = tile;
  content.points = input_.points(tile);
  content.finer = blocks_.segments(range);
  return content;
}

LevelContent LevelMaker::coarsened(const LeafRange& range, const BlockKey& block, LevelContent content,
                                   bool has_level) {
  LevelContent made;
  const bool outermost = blocks_.isOutermost(range), first = content.finer == blocks_.segments(range);
  const double parts = first ? kFirstParts : kParts;
  const bool linking = outermost || !onlyLeaves(content);
  work_.begin(content.points, content.points * (linking ? kBytesOfLinked : kBytesOfPoint) + kBytesOfMasks);
  Neurites& neurites = work_.neurites;
  gather(std::move(content.pieces), neurites);
  removeInsideBalls(neurites, input_.grid);
  // Leaves are as coarse as a first level. Joining them would change little, and takes long.
  if (linking) neurites = linked(std::move(neurites));
  coarsen(neurites, input_.grid, block, parts, {.simplifying = linking});
  const std::uint64_t most = content.finer / (first ? kFewerThanAll : kFewerThanLevel);
  const bool is_tile = outermost || (has_level && neurites.points.size() - neurites.paths.size() <= most);
  made.finer = content.finer;
  if (is_tile) {
    work_.beginTile();
    LevelTile tile = encodeLevel(neurites, block, 0, input_.grid);
    made.finer = tile.entry.segments;
    emit(std::move(tile));
  }
  if (outermost)
    makeCoarser(neurites, block, parts / kStep);
  else
    keep(neurites, made);
  return made;
}

void LevelMaker::gather(std::vector<LevelPiece> pieces, Neurites& all) const {
  for (LevelPiece& piece : pieces) {
    if (piece.leaf) {
      Neurites neurites = input_.neurites(*piece.leaf);
      somata_.apply(neurites, input_.leaves[*piece.leaf]);
      append(all, neurites);
    } else if (piece.spooled) {
      std::vector<std::uint8_t> bytes(piece.spooled->bytes());
      ByteChain::Reader(*piece.spooled, true).read(bytes.data(), bytes.size());
      append(all, unpacked(bytes));
    } else {
      append(all, piece.neurites);
    }
    piece = {};
  }
}

void LevelMaker::keep(const Neurites& neurites, LevelContent& content) {
  content.points = neurites.points.size();
  LevelPiece& piece = content.pieces.emplace_back();
  if (content.points > kKeptPoints) {
    piece.spooled.emplace(spool_);
    piece.spooled->append(packed(neurites));
    piece.spooled->close();
  } else {
    piece.neurites = neurites;
    piece.hold = MemoryBudget::Hold(budget_, bytesOf(piece.neurites));
  }
}

void LevelMaker::makeCoarser(Neurites& neurites, const BlockKey& block, double parts) {
  std::uint32_t coarser = 0;
  for (; parts >= kFewestParts && neurites.points.size() > kFewSegments; parts /= kStep) {
    coarsen(neurites, input_.grid, block, parts, {.every_cell = false});
    emit(encodeLevel(neurites, block, ++coarser, input_.grid));
  }
}

}  // namespace filiform::internal
