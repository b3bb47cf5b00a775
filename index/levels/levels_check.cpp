// checkLevels() of levels.h.
#include "index/cell/soma.h"
#include "index/count_text.h"
#include "index/levels/levels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_set>
#include <utility>

namespace filiform {
namespace {

// Directions from which the pixels of hidden segments must be covered.
const std::array<std::array<Vector3d, 2>, 3>& views() {
  static const std::array<std::array<Vector3d, 2>, 3> all{{{Vector3d::UnitX(), Vector3d::UnitY()},
                                                           {Vector3d::UnitY(), Vector3d::UnitZ()},
                                                           {Vector3d::UnitZ(), Vector3d::UnitX()}}};
  return all;
}

// The pixels that a level tile covers. Their size allows for simplification of what covers them.
class Cover {
 public:
  explicit Cover(double pixel_um) : pixel_um_(pixel_um) {}

  void add(const Vector3d& a_W, const Vector3d& b_W) {
    const auto steps = static_cast<int>((b_W - a_W).cwiseAbs().maxCoeff() / pixel_um_ * 2) + 1;
    for (int i = 0; i <= steps; ++i) {
      const Vector3d p_W = a_W + (b_W - a_W) * (static_cast<double>(i) / steps);
      for (std::size_t v = 0; v < views().size(); ++v) covered_[v].insert(pixel(v, p_W, 0, 0));
    }
  }
  bool hides(const Vector3d& p_W) const {
    for (std::size_t v = 0; v < views().size(); ++v) {
      bool found = false;
      for (int dx = -1; dx <= 1 && !found; ++dx)
        for (int dy = -1; dy <= 1 && !found; ++dy) found = covered_[v].contains(pixel(v, p_W, dx, dy));
      if (!found) return false;
    }
    return true;
  }

 private:
  std::uint64_t pixel(std::size_t view, const Vector3d& p_W, int dx, int dy) const {
    const auto at = [&](const Vector3d& axis, int shift) {
      return static_cast<std::uint32_t>(static_cast<std::int64_t>(std::floor(p_W.dot(axis) / pixel_um_)) + shift);
    };
    return std::uint64_t{at(views()[view][0], dx)} << 32 | at(views()[view][1], dy);
  }
  double pixel_um_;
  std::array<std::unordered_set<std::uint64_t>, 3> covered_;
};

struct Piece {
  std::uint32_t cell;
  Vector3d a_W, b_W;
  double radius_um;         // of a ball, else 0
  bool is_reached = false;  // a segment in full resolution lies within the error of its middle
};

constexpr double kCheckedBallMargin = 1.06;  // radii are rounded to 3 %, and samples of a soma may lie 2 % outside

double square(double x) { return x * x; }

double squaredDistanceToSegment(const Vector3d& p_W, const Vector3d& a_W, const Vector3d& b_W) {
  const Vector3d way = b_W - a_W, d = p_W - a_W;
  const double squared = way.squaredNorm();
  const double t = squared > 0 ? std::clamp(d.dot(way) / squared, 0.0, 1.0) : 0.0;
  return (d - t * way).squaredNorm();
}

// One level tile while the full-resolution tiles below it go by.
class OpenLevel {
 public:
  OpenLevel(const TileSet& set, const Levels& levels, LevelId level)
      : level_(level), entry_(levels.entry(level)), cover_(2 * std::max(entry_.pixel_um, entry_.error_um)) {
    const std::shared_ptr<const Tile> tile = levels.load(level);
    const TileAppearance appearance = levels.loadAppearance(level);
    if (appearance.types.size() != tile->segment_count()) say("its appearance has the wrong length");
    // Tolerance for rounding of the distances below, also far from the origin.
    error_ = entry_.error_um * (1 + 1e-9) + set.grid().quantum_um() * 1e-3;
    error2_ = square(error_);
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
      const bool ball = tile->isolated(s) && appearance.types[s] == kSomaType && appearance.radii_um[s] > 0;
      pieces_.push_back({tile->segmentId(s).cell, tile->position_W(tile->child(s)), tile->position_W(tile->parent(s)),
                         ball ? kCheckedBallMargin * static_cast<double>(appearance.radii_um[s]) : 0, ball});
      if (entry_.hidden > 0) cover_.add(pieces_.back().a_W, pieces_.back().b_W);
    }
  }

  MortonKey high() const { return entry_.key.high(); }

  void add(const Tile& tile) {
    for (std::uint32_t s = 0; s < tile.segment_count(); ++s)
      if (tile.owned(s)) add(tile.segmentId(s).cell, tile.position_W(tile.child(s)), tile.position_W(tile.parent(s)));
  }

  std::vector<std::string> finish() {
    if (owned_ != entry_.represented + entry_.hidden)
      say("represents " + std::to_string(entry_.represented) + " and hides " + std::to_string(entry_.hidden) +
          " segments, but there are " + std::to_string(owned_));
    if (far_ > 0) say(counted(far_, "segment") + " farther than its error and not covered by others");
    if (far_ + covered_ > entry_.hidden)
      say(counted(far_ + covered_, "segment") + " farther than its error, but only " + std::to_string(entry_.hidden) +
          " are stated as hidden");
    const auto strays = std::count_if(pieces_.begin(), pieces_.end(), [](const Piece& p) { return !p.is_reached; });
    if (strays > 0) say(std::to_string(strays) + " of its segments lie farther than its error from their cells");
    if (missing_ > 0) say("lacks " + counted(missing_, "segment") + " of cells of which it has none");
    return std::move(problems_);
  }

 private:
  void say(const std::string& what) { problems_.push_back("level tile " + std::to_string(level_) + ": " + what); }

  void add(std::uint32_t cell, const Vector3d& a_W, const Vector3d& b_W) {
    ++owned_;
    const auto first = std::lower_bound(pieces_.begin(), pieces_.end(), cell,
                                        [](const Piece& piece, std::uint32_t of) { return piece.cell < of; });
    const auto last = std::find_if(first, pieces_.end(), [&](const Piece& piece) { return piece.cell != cell; });
    if (first == last && entry_.coarser == 0) ++missing_;
    for (auto piece = first; piece != last; ++piece)
      if (!piece->is_reached)
        piece->is_reached = squaredDistanceToSegment(0.5 * (piece->a_W + piece->b_W), a_W, b_W) <= error2_;
    for (const Vector3d& p_W : {a_W, b_W, Vector3d(0.5 * (a_W + b_W))}) {
      if (std::any_of(first, last, [&](const Piece& piece) {
            const double squared = squaredDistanceToSegment(p_W, piece.a_W, piece.b_W);
            return squared <= error2_ || (piece.radius_um > 0 && squared <= square(error_ + piece.radius_um));
          }))
        continue;
      ++(entry_.hidden > 0 && cover_.hides(p_W) ? covered_ : far_);
      return;
    }
  }

  LevelId level_;
  const LevelEntry& entry_;
  Cover cover_;
  double error_ = 0, error2_ = 0;
  std::vector<Piece> pieces_;  // by cell
  std::uint64_t owned_ = 0, far_ = 0, covered_ = 0, missing_ = 0;
  std::vector<std::string> problems_;
};

}  // namespace

std::vector<std::string> checkLevels(const TileSet& set, const Levels& levels) {
  std::vector<std::string> problems;
  std::vector<OpenLevel> inside;
  const auto finish = [&] {
    const std::vector<std::string> found = inside.back().finish();
    problems.insert(problems.end(), found.begin(), found.end());
    inside.pop_back();
  };
  LevelId level = 0;
  for (TileId id = 0; id < set.tile_count(); ++id) {
    if (id == set.long_tile()) continue;
    const MortonKey low = set.entry(id).key.low;
    while (!inside.empty() && inside.back().high() < low) finish();
    for (; level < levels.size() && levels.entry(level).key.low <= low; ++level) {
      if (levels.entry(level).key.high() < low)
        problems.push_back("level tile " + std::to_string(level) + ": it contains no tile");
      else
        inside.emplace_back(set, levels, level);
    }
    if (inside.empty() && levels.size() > 0)
      problems.push_back("tile " + std::to_string(id) + ": no level tile contains it");
    const std::shared_ptr<const Tile> tile = set.load(id);
    for (OpenLevel& open : inside) open.add(*tile);
  }
  while (!inside.empty()) finish();
  if (level != levels.size()) problems.push_back("a level tile contains no tiles");
  return problems;
}

}  // namespace filiform
