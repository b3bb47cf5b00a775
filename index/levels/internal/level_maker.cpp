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

// Of some paths: the segments in full resolution that they represent, and their length in quanta.
struct Account {
  std::uint64_t segments = 0;
  double length = 0;
};
Account accountOf(const Neurites& all, std::size_t begin, std::size_t end) {
  Account sum;
  for (std::size_t i = begin; i < end; ++i) {
    const NeuritePoint* points = all.points.data() + all.paths[i].begin;
    sum.segments += points[0].segments;
    for (std::uint32_t k = 1; k < all.paths[i].count; ++k) {
      sum.segments += points[k].segments;
      sum.length += (points[k].p - points[k - 1].p).cast<double>().norm();
    }
  }
  return sum;
}

// How neurites of a block are made coarser: to 1 / parts of its extent.
class Coarsening {
 public:
  Coarsening(const Grid& grid, const BlockKey& block, double parts) : grid_(grid), block_(block), parts_(parts) {}

  // What is to be made coarser together.
  void look(const Neurites& neurites) {
    for (const NeuritePoint& point : neurites.points) box_.extend(point.p);
    length_ += accountOf(neurites, 0, neurites.paths.size()).length;
  }
  void simplify(Neurites& neurites) const {
    constexpr double kLeast = 0.25;  // of the tolerance
    if (unit_um() > 0) filiform::simplify(neurites, grid_, std::max(kLeast * unit_um(), unit_um() - neurites.error_um));
  }
  void hide(Neurites& all, bool every_cell, std::span<std::size_t> bounds = {}) const {
    if (unit_um() > 0 && layers() > kLayers) filiform::hide(all, grid_, pixel_um(), every_cell, bounds);
  }

 private:
  double unit_um() const { return extentOf_um(block_, box_, grid_) / parts_; }
  double pixel_um() const {
    constexpr double kMostPixels = 2048;  // of the extent of the content
    return std::max(unit_um(), (box_.hi - box_.lo).cast<double>().maxCoeff() * grid_.quantum_um() / kMostPixels);
  }
  // How many times the neurites would cover the smallest side of their box with lines of one pixel.
  double layers() const {
    const Vector3d size = (box_.hi - box_.lo).cast<double>();
    const double least_area = std::min({size.x() * size.y(), size.y() * size.z(), size.z() * size.x()});
    return least_area > 0 ? length_ * pixel_um() / grid_.quantum_um() / least_area : 0;
  }

  const Grid& grid_;
  const BlockKey& block_;
  const double parts_;
  GridBox box_;
  double length_ = 0;
};

// Some of the paths, whose points follow each other, with the error of all.
Neurites someOf(const Neurites& all, std::size_t begin, std::size_t end) {
  Neurites some;
  some.error_um = all.error_um;
  some.pixel_um = all.pixel_um;
  some.paths.assign(all.paths.begin() + static_cast<std::ptrdiff_t>(begin),
                    all.paths.begin() + static_cast<std::ptrdiff_t>(end));
  const std::uint32_t first = begin < end ? some.paths.front().begin : 0;
  for (NeuritePath& path : some.paths) path.begin -= first;
  if (begin < end)
    some.points.assign(all.points.begin() + first,
                       all.points.begin() + first + some.paths.back().begin + some.paths.back().count);
  return some;
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
  content.points = input_.points(tile);
  content.finer = blocks_.segments(range);
  LevelPiece& piece = content.pieces.emplace_back();
  piece.first_leaf = range.begin;
  piece.finer = content.finer;
  piece.block = blocks_.leaf(range.begin);
  piece.leaf = tile;
  return content;
}

// Halves the block until few finer segments lie in each part. Pieces stay whole.
void LevelMaker::cut(std::span<const LevelPiece> pieces, std::size_t begin, const LeafRange& range,
                     std::vector<Cut>& cuts) const {
  std::uint64_t finer = 0;
  for (const LevelPiece& piece : pieces) finer += piece.finer;
  if (pieces.size() == 1) {
    cuts.push_back({pieces[0].block, pieces[0].tiles_of_block, begin, begin + 1});
    return;
  }
  const BlockKey block = blocks_.tightBlock(range);
  if (finer <= blocks_.cutSegments()) {
    cuts.push_back({block, 0, begin, begin + pieces.size()});
    return;
  }
  const MortonKey upper = block.half(1).low;
  std::size_t lower = 1;
  while (lower < pieces.size() && blocks_.leaf(pieces[lower].first_leaf).low < upper) ++lower;
  const std::size_t middle = pieces[lower].first_leaf;
  cut(pieces.first(lower), begin, {range.begin, middle}, cuts);
  cut(pieces.subspan(lower), begin + lower, {middle, range.end}, cuts);
}

LevelContent LevelMaker::coarsened(const LeafRange& range, const BlockKey& block, LevelContent content,
                                   bool has_level) {
  const bool outermost = blocks_.isOutermost(range), first = content.finer == blocks_.segments(range);
  const double parts = first ? kFirstParts : kParts;
  // Leaves are as coarse as a first level. Joining them would change little, and takes long.
  const bool linking = outermost || !onlyLeaves(content);
  std::vector<Cut> cuts;
  if (has_level) cut(content.pieces, 0, range, cuts);
  if (cuts.size() < 2) cuts.assign(1, {block, 0, 0, content.pieces.size()});
  work_.begin(content.points, content.points * (linking ? kBytesOfLinked : kBytesOfPoint) + kBytesOfMasks);

  Neurites& all = work_.neurites;
  std::vector<std::size_t> bounds;  // among the paths: where those of each cut begin
  std::vector<Neurites> made_of;    // what each cut holds; without paths once they are in `all`
  const std::vector<SomaRoot> balls = somata_.within(block);
  Coarsening coarsening(input_.grid, block, parts);
  const auto add = [&](Neurites& part) {
    bounds.push_back(all.paths.size());
    append(all, part);
    part.paths = {};
    part.points = {};
  };
  for (const Cut& of : cuts) {
    Neurites& part = made_of.emplace_back();
    gather(std::span(content.pieces).subspan(of.begin, of.end - of.begin), part);
    removeInsideBalls(part, balls, input_.grid);
    if (linking) part = linked(std::move(part));
    coarsening.look(part);
    if (!linking) add(part);
  }
  if (linking)
    for (Neurites& part : made_of) {
      coarsening.simplify(part);
      add(part);
    }
  const auto account = [&](std::size_t i) {
    return accountOf(all, bounds[i], i + 1 < bounds.size() ? bounds[i + 1] : all.paths.size());
  };
  std::vector<Account> before;
  for (std::size_t i = 0; i < cuts.size(); ++i) before.push_back(account(i));
  coarsening.hide(all, true, bounds);
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    const Account left = account(i);
    made_of[i].represented -= before[i].segments - left.segments;
    made_of[i].hidden += before[i].segments - left.segments;
    made_of[i].hidden_um += std::max(0.0, before[i].length - left.length) * input_.grid.quantum_um();
  }

  const std::uint64_t most = content.finer / (first ? kFewerThanAll : kFewerThanLevel);
  const bool is_tile = outermost || (has_level && all.points.size() - all.paths.size() <= most);
  LevelPiece piece;
  piece.first_leaf = range.begin;
  piece.finer = content.finer;
  piece.block = block;
  if (is_tile) {
    work_.beginTile();
    piece.finer = 0;
    piece.tiles_of_block = cuts.size() == 1 ? 1 : 0;
    for (std::size_t i = 0; i < cuts.size(); ++i) {
      Neurites tile_of = someOf(all, bounds[i], i + 1 < bounds.size() ? bounds[i + 1] : all.paths.size());
      tile_of.hidden = made_of[i].hidden;
      tile_of.hidden_um = made_of[i].hidden_um;
      tile_of.represented = made_of[i].represented;
      if (tile_of.hidden == 0) tile_of.pixel_um = 0;
      LevelTile tile = encodeLevel(tile_of, cuts[i].key, cuts[i].coarser, input_.grid);
      piece.finer += tile.entry.segments;
      emit(std::move(tile));
    }
  }
  LevelContent made;
  made.finer = piece.finer;
  if (outermost)
    makeCoarser(all, block, parts / kStep, cuts.size() > 1);
  else
    keep(all, std::move(piece), made);
  return made;
}

void LevelMaker::gather(std::span<LevelPiece> pieces, Neurites& all) const {
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

void LevelMaker::keep(const Neurites& neurites, LevelPiece piece, LevelContent& content) {
  content.points = neurites.points.size();
  if (content.points > kKeptPoints) {
    piece.spooled.emplace(spool_);
    piece.spooled->append(packed(neurites));
    piece.spooled->close();
  } else {
    piece.neurites = neurites;
    piece.hold = MemoryBudget::Hold(budget_, bytesOf(piece.neurites));
  }
  content.pieces.push_back(std::move(piece));
}

void LevelMaker::makeCoarser(Neurites& neurites, const BlockKey& block, double parts, bool is_cut) {
  if (is_cut) neurites = linked(std::move(neurites));
  std::uint32_t coarser = 0;
  for (; parts >= kFewestParts && neurites.points.size() > kFewSegments; parts /= kStep) {
    Coarsening coarsening(input_.grid, block, parts);
    coarsening.look(neurites);
    coarsening.simplify(neurites);
    coarsening.hide(neurites, false);
    emit(encodeLevel(neurites, block, ++coarser, input_.grid));
  }
}

}  // namespace filiform::internal
