#include "index/levels/internal/level_pieces.h"

#include "index/cell/soma.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace filiform::internal {
namespace {

using Cube = Eigen::Matrix<std::int64_t, 3, 1>;

constexpr double kCheckedBallMargin = 1.06;  // radii are rounded to 3 %, and samples of a soma may lie 2 % outside
constexpr double kMostReach_um = 1e18;       // larger than the world
constexpr double kCubeRounding = 1e-3;       // of an edge: more than the rounding of places in cubes
constexpr std::uint32_t kBallSalt = 0x9E3779B9u;

double inverseOf(const Vector3d& way) {
  const double squared = way.squaredNorm();
  return squared > 0 ? 1 / squared : 0;
}

Cube cubeOf(const Vector3d& p_W, double edge_um) { return (p_W / edge_um).array().floor().cast<std::int64_t>(); }

std::uint32_t cubeHash(std::uint32_t salt, const Cube& cube) {
  std::uint64_t h = salt;
  for (int axis = 0; axis < 3; ++axis)
    h = std::rotl(h ^ static_cast<std::uint64_t>(cube[axis]), 23) * 0x9E3779B97F4A7C15u;
  return static_cast<std::uint32_t>(h >> 32);
}

// Into how many parts of at most `edge_um` a segment is cut.
double edgesAlong(const Vector3d& way, double edge_um) { return std::max(1.0, std::ceil(way.norm() / edge_um)); }

// The squared distance of a point from the segment a_W .. a_W + way; `inverse_um2`: 1 / its squared length, or 0.
double squaredToSegment(const Vector3d& p_W, const Vector3d& a_W, const Vector3d& way, double inverse_um2) {
  const Vector3d d = p_W - a_W;
  const double t = std::clamp(d.dot(way) * inverse_um2, 0.0, 1.0);
  return (d - t * way).squaredNorm();
}

}  // namespace

void HashedCubes::add(std::uint32_t piece, std::uint32_t salt, const Vector3d& lo_W, const Vector3d& hi_W,
                      double edge_um) {
  const Cube lo = cubeOf(lo_W, edge_um), hi = cubeOf(hi_W, edge_um);
  Cube at;
  for (at[0] = lo[0]; at[0] <= hi[0]; ++at[0])
    for (at[1] = lo[1]; at[1] <= hi[1]; ++at[1])
      for (at[2] = lo[2]; at[2] <= hi[2]; ++at[2]) entries_.emplace_back(cubeHash(salt, at), piece);
}

void HashedCubes::build() {
  const std::uint32_t lists = std::bit_ceil(static_cast<std::uint32_t>(entries_.size()) + 1);
  begin_.assign(lists + std::size_t{1}, 0);
  for (auto& [hash, piece] : entries_) ++begin_[(hash &= lists - 1) + 1];
  for (std::uint32_t i = 0; i < lists; ++i) begin_[i + 1] += begin_[i];
  pieces_.resize(entries_.size());
  end_.assign(begin_.begin(), begin_.end() - 1);
  for (const auto& [hash, piece] : entries_) pieces_[end_[hash]++] = piece;
  entries_ = {};
}

std::uint32_t HashedCubes::list(std::uint32_t salt, const Vector3d& p_W, double edge_um) const {
  return cubeHash(salt, cubeOf(p_W, edge_um)) & static_cast<std::uint32_t>(end_.size() - 1);
}

LevelPieces::LevelPieces(const Tile& tile, const TileAppearance& appearance, double error_um)
    : error_um_(std::min(error_um, kMostReach_um)), error_um2_(error_um_ * error_um_) {
  pieces_.reserve(tile.segment_count());
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    const bool is_ball = s < appearance.types.size() && tile.isolated(s) && appearance.types[s] == kSomaType &&
                         appearance.radii_um[s] > 0;
    const Vector3d a_W = tile.position_W(tile.child(s)), way = tile.position_W(tile.parent(s)) - a_W;
    const double radius_um = is_ball ? kCheckedBallMargin * static_cast<double>(appearance.radii_um[s]) : 0;
    pieces_.push_back({tile.segmentId(s).cell, a_W, way, inverseOf(way), std::min(radius_um, kMostReach_um), is_ball});
  }
  for (std::uint32_t begin = 0, end = 0; begin < pieces_.size(); begin = end) {
    while (end < pieces_.size() && pieces_[end].cell == pieces_[begin].cell) ++end;
    cells_.push_back({pieces_[begin].cell, begin, end, 0, 0, 0, begin});
    indexCell(cells_.back());
  }
  near_.build();
  middles_.build();
}

// Cubes are about as large as the cell's pieces, so that each piece lies in a few cubes, and each cube has a few
// pieces.
void LevelPieces::indexCell(CellPieces& cell) {
  double length_um = 0, radius_um = 0;
  for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
    length_um += pieces_[i].way.norm();
    radius_um = std::max(radius_um, pieces_[i].radius_um);
    cell.left += pieces_[i].is_reached ? 0 : 1;
  }
  cell.length_um = std::max(error_um_, length_um / (cell.end - cell.begin));
  const double edge_um = 2 * cell.length_um;
  if (radius_um > 0) cell.ball_edge_um = 2 * (error_um_ + radius_um);
  for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
    const Piece& piece = pieces_[i];
    if (piece.radius_um > 0) {
      const Vector3d margin = Vector3d::Constant(error_um_ + piece.radius_um + kCubeRounding * cell.ball_edge_um);
      near_.add(i, cell.cell ^ kBallSalt, piece.a_W - margin, piece.a_W + margin, cell.ball_edge_um);
      continue;
    }
    const Vector3d margin = Vector3d::Constant(error_um_ + kCubeRounding * edge_um);
    const double parts = edgesAlong(piece.way, edge_um);
    for (double part = 0; part < parts; ++part) {
      const Vector3d a_W = piece.a_W + piece.way * (part / parts), b_W = piece.a_W + piece.way * ((part + 1) / parts);
      near_.add(i, cell.cell, a_W.cwiseMin(b_W) - margin, a_W.cwiseMax(b_W) + margin, edge_um);
    }
    // Full-resolution segments ask at the middles of parts of the typical length.
    const Vector3d half = margin + Vector3d::Constant(0.5 * cell.length_um);
    middles_.add(i, cell.cell, piece.middle_W() - half, piece.middle_W() + half, edge_um);
  }
}

LevelPieces::CellPieces* LevelPieces::find(std::uint32_t cell) {
  const auto found = std::lower_bound(cells_.begin(), cells_.end(), cell,
                                      [](const CellPieces& pieces, std::uint32_t of) { return pieces.cell < of; });
  return found != cells_.end() && found->cell == cell ? &*found : nullptr;
}

bool LevelPieces::isNear(CellPieces& cell, const Vector3d& p_W) const {
  const auto isNearTo = [&](std::uint32_t i) {
    const Piece& piece = pieces_[i];
    const double most_um = error_um_ + piece.radius_um;
    return piece.cell == cell.cell &&
           squaredToSegment(p_W, piece.a_W, piece.way, piece.inverse_um2) <= most_um * most_um;
  };
  if (isNearTo(cell.last)) return true;
  const auto isNearOneOf = [&](std::uint32_t list) {
    for (std::uint32_t at = near_.begin(list); at < near_.end(list); ++at) {
      if (!isNearTo(near_.piece(at))) continue;
      cell.last = near_.piece(at);
      return true;
    }
    return false;
  };
  return isNearOneOf(near_.list(cell.cell, p_W, 2 * cell.length_um)) ||
         (cell.ball_edge_um > 0 && isNearOneOf(near_.list(cell.cell ^ kBallSalt, p_W, cell.ball_edge_um)));
}

void LevelPieces::reach(CellPieces& cell, const Vector3d& a_W, const Vector3d& b_W) {
  if (cell.left == 0) return;
  const Vector3d way = b_W - a_W;
  const double inverse_um2 = inverseOf(way), parts = edgesAlong(way, cell.length_um);
  const auto isReached = [&](std::uint32_t i) {  // now or before
    Piece& piece = pieces_[i];
    if (piece.is_reached || piece.cell != cell.cell) return piece.is_reached;
    piece.is_reached = squaredToSegment(piece.middle_W(), a_W, way, inverse_um2) <= error_um2_;
    cell.left -= piece.is_reached ? 1 : 0;
    return piece.is_reached;
  };
  if (parts > cell.end - cell.begin) {
    for (std::uint32_t i = cell.begin; i < cell.end; ++i) isReached(i);
    return;
  }
  for (double part = 0; part < parts; ++part) {
    const std::uint32_t list = middles_.list(cell.cell, a_W + way * ((part + 0.5) / parts), 2 * cell.length_um);
    for (std::uint32_t at = middles_.begin(list); at < middles_.end(list);)
      if (isReached(middles_.piece(at)))
        middles_.remove(list, at);
      else
        ++at;
  }
}

std::uint64_t LevelPieces::unreached() const {
  std::uint64_t sum = 0;
  for (const CellPieces& cell : cells_) sum += cell.left;
  return sum;
}

}  // namespace filiform::internal
