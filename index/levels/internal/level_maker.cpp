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
// Of the outermost block's further levels: their units, in parts of its extent; a cut shows a fraction of the segments
// that other cuts show; a tile has so many times fewer segments than the tiles below it.
constexpr double kStep = 1.5, kMostParts = 2048, kFewestParts = 16, kFewer = 1.5;
constexpr std::uint64_t kSmallerCut = 8;
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
  double unit_um() const { return extentOf_um(block_, box_, grid_) / parts_; }
  void simplify(Neurites& neurites) const {
    constexpr double kLeast = 0.25;  // of the tolerance
    if (unit_um() > 0) filiform::simplify(neurites, grid_, std::max(kLeast * unit_um(), unit_um() - neurites.error_um));
  }
  // True if the neurites cover the pixels of a unit so often that hiding them pays.
  bool isDense() const { return unit_um() > 0 && layers() > kLayers; }
  void hide(Neurites& all, bool every_cell, std::span<std::size_t> bounds) const {
    if (unit_um() > 0) filiform::hide(all, grid_, pixel_um(), every_cell, bounds);
  }

 private:
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

}  // namespace

// The cuts of a block, to be simplified and hidden together.
class LevelMaker::Joined {
 public:
  explicit Joined(Neurites& all) : all_(all) {}

  std::vector<Neurites> cuts;  // what each holds; without paths once it is added

  // Adds the next cut to the others. Its paths follow theirs.
  void add(Neurites& cut) {
    bounds_.push_back(all_.paths.size());
    append(all_, cut);
    cut.paths = {};
    cut.points = {};
  }
  void hide(const Coarsening& coarsening, bool every_cell, const Grid& grid) {
    std::vector<Account> before;
    for (std::size_t i = 0; i < cuts.size(); ++i) before.push_back(accountOf(all_, bounds_[i], end(i)));
    coarsening.hide(all_, every_cell, bounds_);
    for (std::size_t i = 0; i < cuts.size(); ++i) {
      const Account left = accountOf(all_, bounds_[i], end(i));
      cuts[i].represented -= before[i].segments - left.segments;
      cuts[i].hidden += before[i].segments - left.segments;
      cuts[i].hidden_um += std::max(0.0, before[i].length - left.length) * grid.quantum_um();
    }
  }
  // A cut with its paths, and the error of all: branches may begin at a neurite of another cut.
  Neurites part(std::size_t i) const {
    Neurites some;
    some.error_um = all_.error_um;
    some.hidden = cuts[i].hidden;
    some.hidden_um = cuts[i].hidden_um;
    some.represented = cuts[i].represented;
    if (some.hidden > 0) some.pixel_um = all_.pixel_um;
    some.paths.assign(all_.paths.begin() + static_cast<std::ptrdiff_t>(bounds_[i]),
                      all_.paths.begin() + static_cast<std::ptrdiff_t>(end(i)));
    if (some.paths.empty()) return some;
    const std::uint32_t first = some.paths.front().begin;
    for (NeuritePath& path : some.paths) path.begin -= first;
    some.points.assign(all_.points.begin() + first,
                       all_.points.begin() + first + some.paths.back().begin + some.paths.back().count);
    return some;
  }

 private:
  std::size_t end(std::size_t i) const { return i + 1 < bounds_.size() ? bounds_[i + 1] : all_.paths.size(); }

  Neurites& all_;
  std::vector<std::size_t> bounds_;  // among the paths: where those of each cut begin
};

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
                     std::uint64_t most_finer, std::vector<Cut>& cuts) const {
  std::uint64_t finer = 0;
  for (const LevelPiece& piece : pieces) finer += piece.finer;
  if (pieces.size() == 1) {
    cuts.push_back({pieces[0].block, pieces[0].first_leaf, pieces[0].tiles_of_block, begin, begin + 1, finer});
    return;
  }
  const BlockKey block = blocks_.tightBlock(range);
  if (finer <= most_finer) {
    cuts.push_back({block, pieces[0].first_leaf, 0, begin, begin + pieces.size(), finer});
    return;
  }
  const MortonKey upper = block.half(1).low;
  std::size_t lower = 1;
  while (lower < pieces.size() && blocks_.leaf(pieces[lower].first_leaf).low < upper) ++lower;
  const std::size_t middle = pieces[lower].first_leaf;
  cut(pieces.first(lower), begin, {range.begin, middle}, most_finer, cuts);
  cut(pieces.subspan(lower), begin + lower, {middle, range.end}, most_finer, cuts);
}

LevelContent LevelMaker::coarsened(const LeafRange& range, const BlockKey& block, LevelContent content,
                                   bool has_level) {
  const bool outermost = blocks_.isOutermost(range), first = content.finer == blocks_.segments(range);
  const double parts = first ? kFirstParts : kParts;
  // Leaves are as coarse as a first level. Joining them would change little, and takes long.
  const bool linking = outermost || !onlyLeaves(content);
  std::vector<Cut> cuts;
  if (has_level) cut(content.pieces, 0, range, blocks_.cutSegments(), cuts);
  if (cuts.size() < 2) cuts.assign(1, {block, range.begin, 0, 0, content.pieces.size(), content.finer});
  work_.begin(content.points, content.points * (linking ? kBytesOfLinked : kBytesOfPoint) + kBytesOfMasks);

  Joined joined(work_.neurites);
  const std::vector<SomaRoot> balls = somata_.within(block);
  Coarsening coarsening(input_.grid, block, parts);
  for (const Cut& of : cuts) {
    Neurites& part = joined.cuts.emplace_back();
    gather(std::span(content.pieces).subspan(of.begin, of.end - of.begin), part);
    removeInsideBalls(part, balls, input_.grid);
    if (linking) part = linked(std::move(part));
    coarsening.look(part);
    if (!linking) joined.add(part);
  }
  if (linking)
    for (Neurites& part : joined.cuts) {
      coarsening.simplify(part);
      joined.add(part);
    }
  const bool hides = coarsening.isDense();
  if (hides) joined.hide(coarsening, true, input_.grid);

  if (outermost) {
    makeCoarser(range, block, hides ? parts / kStep : kMostParts, tiles(cuts, joined, 0));
    return {};
  }
  const Neurites& all = work_.neurites;
  const std::uint64_t most = content.finer / (first ? kFewerThanAll : kFewerThanLevel);
  LevelPiece piece;
  piece.first_leaf = range.begin;
  piece.finer = content.finer;
  piece.block = block;
  if (has_level && all.points.size() - all.paths.size() <= most) {
    piece.finer = 0;
    piece.tiles_of_block = cuts.size() == 1 ? 1 : 0;
    for (const LevelPiece& tile : tiles(cuts, joined, 0)) piece.finer += tile.finer;
  }
  LevelContent made;
  made.finer = piece.finer;
  keep(all, std::move(piece), made);
  return made;
}

// Parts the cuts again, and makes a tile of each that has `fewer` times fewer segments than the tiles below.
std::vector<LevelPiece> LevelMaker::tiles(std::span<const Cut> cuts, const Joined& joined, double fewer) {
  work_.beginTile();
  std::vector<LevelPiece> pieces;
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    const Cut& cut = cuts[i];
    LevelPiece& piece = pieces.emplace_back();
    piece.neurites = joined.part(i);
    piece.first_leaf = cut.first_leaf;
    piece.finer = cut.finer;
    piece.block = cut.key;
    piece.tiles_of_block = cut.coarser;
    const std::size_t segments = piece.neurites.points.size() - piece.neurites.paths.size();
    if (fewer * static_cast<double>(segments) > static_cast<double>(cut.finer)) continue;
    LevelTile tile = encodeLevel(piece.neurites, cut.key, cut.coarser, input_.grid);
    piece.finer = tile.entry.segments;
    ++piece.tiles_of_block;
    emit(std::move(tile));
  }
  return pieces;
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

void LevelMaker::makeCoarser(const LeafRange& range, const BlockKey& block, double parts,
                             std::vector<LevelPiece> pieces) {
  for (; parts >= kFewestParts && (pieces.size() > 1 || pieces[0].finer > kFewSegments); parts /= kStep) {
    const bool is_last = parts < kFewestParts * kStep;
    std::vector<Cut> cuts;
    cut(pieces, 0, range, is_last ? UINT64_MAX : blocks_.cutSegments() / kSmallerCut, cuts);
    if (cuts.size() == 1) cuts[0].key = block;
    std::uint64_t points = 0;
    for (LevelPiece& piece : pieces) {
      points += piece.neurites.points.size();
      piece.hold = MemoryBudget::Hold(budget_, bytesOf(piece.neurites));
    }
    work_.begin(points, points * kBytesOfLinked + kBytesOfMasks);
    Joined joined(work_.neurites);
    Coarsening coarsening(input_.grid, block, parts);
    for (Cut& of : cuts) {
      const std::span<LevelPiece> joining = std::span(pieces).subspan(of.begin, of.end - of.begin);
      for (const LevelPiece& piece : joining) of.coarser = std::max(of.coarser, piece.tiles_of_block);
      Neurites& part = joined.cuts.emplace_back();
      gather(joining, part);
      if (joining.size() > 1) part = linked(std::move(part));
      coarsening.look(part);
    }
    for (Neurites& part : joined.cuts) {
      if (coarsening.unit_um() > part.error_um) coarsening.simplify(part);
      joined.add(part);
    }
    joined.hide(coarsening, false, input_.grid);
    pieces = tiles(cuts, joined, is_last ? 0 : kFewer);
  }
}

}  // namespace filiform::internal
