// checkLevels() of levels.h.
#include "index/count_text.h"
#include "index/levels/internal/level_pieces.h"
#include "index/levels/internal/pixel_cover.h"
#include "index/levels/levels.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

namespace filiform {
namespace {

using internal::LevelPieces;

// A segment that a full-resolution tile owns.
struct FullSegment {
  std::uint32_t cell;
  Vector3d child_W, parent_W;
};

std::vector<FullSegment> ownedOf(const Tile& tile) {
  std::vector<FullSegment> owned;
  owned.reserve(tile.owned_count());
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    if (!tile.owned(s)) continue;
    const Tile::Link link = tile.link(s);
    owned.push_back({link.id.cell, tile.position_W(link.child), tile.position_W(link.parent)});
  }
  return owned;
}

// The level tiles beside one: those with which its segments were hidden. Their segments together cover the pixels of
// what each of them hides.
class Siblings {
 public:
  Siblings(const Levels& levels, const std::vector<LevelId>& beside) {
    std::vector<std::shared_ptr<const Tile>> tiles;
    double pixel_um = 0;
    bool hides_some = false;
    for (const LevelId level : beside) {
      const LevelEntry& entry = levels.entry(level);
      tiles.push_back(levels.load(level));
      addBalls(*tiles.back(), levels.loadAppearance(level));
      pixel_um = std::max(pixel_um, checkedPixel_um(entry, *tiles.back()));
      hides_some |= entry.hidden > 0;
      for (std::uint32_t s = 0; s < tiles.back()->segment_count(); ++s) cells_.insert(tiles.back()->segmentId(s).cell);
    }
    cover_.emplace(pixel_um);
    for (const auto& tile : tiles)
      for (std::uint32_t s = 0; hides_some && s < tile->segment_count(); ++s)
        cover_->add(tile->position_W(tile->child(s)), tile->position_W(tile->parent(s)));
  }

  bool hasCell(std::uint32_t cell) const { return cells_.contains(cell); }
  bool hides(const Vector3d& p_W) { return cover_->hides(p_W); }
  // True if the point lies in the ball of a soma of the cell, or within the error of its surface.
  bool isInBall(std::uint32_t cell, const Vector3d& p_W, double error_um) const {
    const auto [first, last] = balls_.equal_range(cell);
    return std::any_of(first, last, [&](const auto& of_cell) {
      return (p_W - of_cell.second.a_W).norm() <= of_cell.second.radius_um + error_um;
    });
  }

 private:
  void addBalls(const Tile& tile, const TileAppearance& appearance) {
    const LevelPieces pieces(tile, appearance, 0);
    for (const LevelPieces::Piece& piece : pieces.pieces())
      if (piece.radius_um > 0) balls_.emplace(piece.cell, piece);
  }
  // Pixels allow for the simplification of what covers them. They are so large that segments cover few pixels on
  // average, whatever the table states.
  static double checkedPixel_um(const LevelEntry& entry, const Tile& tile) {
    constexpr double kMostPixels = 256;  // a segment, on average
    double length_um = 0;
    for (std::uint32_t s = 0; s < tile.segment_count(); ++s)
      length_um += (tile.position_W(tile.parent(s)) - tile.position_W(tile.child(s))).norm();
    const double segments = std::max<double>(1, tile.segment_count());
    return std::max(2 * std::max(entry.pixel_um, entry.error_um), length_um / (kMostPixels * segments));
  }

  std::unordered_set<std::uint32_t> cells_;
  std::unordered_multimap<std::uint32_t, LevelPieces::Piece> balls_;
  std::optional<internal::PixelCover> cover_;
};

// The level tiles beside each: those directly below the same tile. Of the outermost block, whose levels are parted
// anew, those that show the rest of the set as finely.
class Beside {
 public:
  explicit Beside(const Levels& levels) : levels_(levels) {}

  std::shared_ptr<Siblings> of(LevelId level) {
    const LevelEntry& own = levels_.entry(level);
    const LevelId above = levels_.above({true, level, 0, 0});
    Fineness most{0, 0};
    if (!isCoarser(above))
      most = {INFINITY, INFINITY};
    else if (own.coarser > 0)
      most = {own.error_um, own.pixel_um};
    std::shared_ptr<Siblings>& made = made_[{isCoarser(above) ? Levels::kRoots : above, most}];
    if (!made) {
      std::vector<LevelId> tiles;
      collect(isCoarser(above) ? Levels::kRoots : above, most, tiles);
      made = std::make_shared<Siblings>(levels_, tiles);
    }
    return made;
  }
  // No tile below this one is asked for again.
  void forget(LevelId above) {
    made_.erase(made_.lower_bound({above, Fineness{}}), made_.upper_bound({above, Fineness{INFINITY, INFINITY}}));
  }

 private:
  using Fineness = std::pair<double, double>;  // error, pixel

  // True for the outermost block's coarser tiles, and for what contains all.
  bool isCoarser(LevelId level) const {
    for (; level != Levels::kRoots; level = levels_.above({true, level, 0, 0}))
      if (levels_.entry(level).coarser == 0) return false;
    return true;
  }
  void collect(LevelId above, const Fineness& most, std::vector<LevelId>& tiles) const {
    for (const LevelPart& part : levels_.below(above)) {
      if (!part.level) continue;
      const LevelEntry& entry = levels_.entry(part.tile);
      if (entry.coarser > 0 && (entry.error_um > most.first || entry.pixel_um > most.second))
        collect(part.tile, most, tiles);
      else
        tiles.push_back(part.tile);
    }
  }

  const Levels& levels_;
  std::map<std::pair<LevelId, Fineness>, std::shared_ptr<Siblings>> made_;
};

// One level tile while the full-resolution tiles below it go by.
class OpenLevel {
 public:
  OpenLevel(const TileSet& set, const Levels& levels, LevelId level, std::shared_ptr<Siblings> siblings)
      : OpenLevel(set, levels.entry(level), level, *levels.load(level), levels.loadAppearance(level),
                  std::move(siblings)) {}

  LevelId level() const { return level_; }
  MortonKey high() const { return entry_.key.high(); }

  void add(const std::vector<FullSegment>& segments) {
    owned_ += segments.size();
    LevelPieces::CellPieces* cell = nullptr;
    // Most segments begin where the one before ends.
    Vector3d last_W = Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    bool is_last_near = false;
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const FullSegment& s = segments[i];
      if (i == 0 || s.cell != segments[i - 1].cell) {
        cell = pieces_.find(s.cell);
        last_W.setConstant(std::numeric_limits<double>::quiet_NaN());
      }
      if (cell == nullptr) {
        if (entry_.coarser == 0 && !siblings_->hasCell(s.cell)) ++missing_;
      } else {
        pieces_.reach(*cell, s.child_W, s.parent_W);
      }
      const auto isNear = [&](const Vector3d& p_W) {
        return (cell != nullptr && pieces_.isNear(*cell, p_W)) || siblings_->isInBall(s.cell, p_W, error_um_);
      };
      const bool is_known = s.parent_W == last_W, was_near = is_last_near;
      last_W = s.child_W;
      is_last_near = isNear(s.child_W);
      const Vector3d middle_W = 0.5 * (s.child_W + s.parent_W);
      if (!is_last_near)
        countFar(s.child_W);
      else if (!(is_known ? was_near : isNear(s.parent_W)))
        countFar(s.parent_W);
      else if (!isNear(middle_W))
        countFar(middle_W);
    }
  }

  std::vector<std::string> finish() {
    if (owned_ != entry_.represented + entry_.hidden)
      say("represents " + std::to_string(entry_.represented) + " and hides " + std::to_string(entry_.hidden) +
          " segments, but there are " + std::to_string(owned_));
    if (far_ > 0) say(counted(far_, "segment") + " farther than its error and not covered by others");
    if (far_ + covered_ > entry_.hidden)
      say(counted(far_ + covered_, "segment") + " farther than its error, but only " + std::to_string(entry_.hidden) +
          " are stated as hidden");
    const std::uint64_t strays = pieces_.unreached();
    if (strays > 0) say(std::to_string(strays) + " of its segments lie farther than its error from their cells");
    if (missing_ > 0) say("lacks " + counted(missing_, "segment") + " of cells of which it has none");
    return std::move(problems_);
  }

 private:
  // The error allows for rounding of the distances, also far from the origin.
  OpenLevel(const TileSet& set, const LevelEntry& entry, LevelId level, const Tile& tile,
            const TileAppearance& appearance, std::shared_ptr<Siblings> siblings)
      : level_(level),
        entry_(entry),
        error_um_(entry.error_um * (1 + 1e-9) + set.grid().quantum_um() * 1e-3),
        pieces_(tile, appearance, error_um_),
        siblings_(std::move(siblings)) {
    if (appearance.types.size() != tile.segment_count()) say("its appearance has the wrong length");
  }

  void say(const std::string& what) { problems_.push_back("level tile " + std::to_string(level_) + ": " + what); }
  void countFar(const Vector3d& p_W) { ++(entry_.hidden > 0 && siblings_->hides(p_W) ? covered_ : far_); }

  LevelId level_;
  const LevelEntry& entry_;
  double error_um_;
  LevelPieces pieces_;
  std::shared_ptr<Siblings> siblings_;
  std::uint64_t owned_ = 0, far_ = 0, covered_ = 0, missing_ = 0;
  std::vector<std::string> problems_;
};

}  // namespace

std::vector<std::string> checkLevels(const TileSet& set, const Levels& levels) {
  std::vector<std::string> problems;
  std::vector<OpenLevel> inside;
  Beside beside(levels);
  const auto finish = [&] {
    const std::vector<std::string> found = inside.back().finish();
    problems.insert(problems.end(), found.begin(), found.end());
    beside.forget(inside.back().level());
    inside.pop_back();
  };
  LevelId level = 0;
  for (TileId id = 0; id < set.tile_count(); ++id) {
    if (id == set.long_tile()) continue;
    const MortonKey low = set.entry(id).key.low;
    while (!inside.empty() && inside.back().high() < low) finish();
    for (; level < levels.size() && levels.entry(level).key.low <= low; ++level) {
      if (levels.entry(level).key.high() < low) {
        problems.push_back("level tile " + std::to_string(level) + ": it contains no tile");
        continue;
      }
      inside.emplace_back(set, levels, level, beside.of(level));
    }
    if (inside.empty() && levels.size() > 0)
      problems.push_back("tile " + std::to_string(id) + ": no level tile contains it");
    const std::vector<FullSegment> owned = ownedOf(*set.load(id));
    for (OpenLevel& open : inside) open.add(owned);
  }
  while (!inside.empty()) finish();
  if (level != levels.size()) problems.push_back("a level tile contains no tiles");
  return problems;
}

}  // namespace filiform
