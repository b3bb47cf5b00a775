// LevelPieces: the segments and balls of a level tile, found by cell and place. checkLevels() compares them with the
// full-resolution segments.
#pragma once

#include "index/geometry/grid.h"
#include "index/tile/tile.h"

#include <cstdint>
#include <utility>
#include <vector>

namespace filiform::internal {

// Hashed cubes, each with a list of pieces. Cubes with the same hash share a list.
class HashedCubes {
 public:
  // Adds a piece to all cubes of edge `edge_um` that the box meets. Requires that build() was not called.
  void add(std::uint32_t piece, std::uint32_t salt, const Vector3d& lo_W, const Vector3d& hi_W, double edge_um);
  void build();  // O(entries)
  std::uint32_t list(std::uint32_t salt, const Vector3d& p_W, double edge_um) const;
  std::uint32_t begin(std::uint32_t list) const { return begin_[list]; }
  std::uint32_t end(std::uint32_t list) const { return end_[list]; }
  std::uint32_t piece(std::uint32_t at) const { return pieces_[at]; }
  // Removes one entry; the list's last one takes its place.
  void remove(std::uint32_t list, std::uint32_t at) { pieces_[at] = pieces_[--end_[list]]; }

 private:
  std::vector<std::pair<std::uint32_t, std::uint32_t>> entries_;  // hash, piece; until build()
  std::vector<std::uint32_t> begin_, end_, pieces_;
};

// Thread rule: externally synchronised.
class LevelPieces {
 public:
  // `error_um`: within this distance a piece represents a full-resolution segment. O(segments of the tile).
  LevelPieces(const Tile& tile, const TileAppearance& appearance, double error_um);

  struct Piece {
    std::uint32_t cell;
    Vector3d a_W, way;
    double inverse_um2;       // 1 / squared length; 0: a point
    double radius_um;         // of a ball, else 0
    bool is_reached = false;  // a full-resolution segment lies within the error of its middle

    Vector3d middle_W() const { return a_W + 0.5 * way; }
  };
  const std::vector<Piece>& pieces() const { return pieces_; }

  struct CellPieces {
    std::uint32_t cell, begin, end;  // its pieces
    double length_um;                // typical of its segments, at least the error; their cubes are twice as large
    double ball_edge_um;             // of the cubes of its balls; 0: none
    std::uint32_t left;              // pieces that are not reached
    std::uint32_t last;              // the last piece that was near
  };
  // The pieces of a cell; nullptr: none. O(log cells).
  CellPieces* find(std::uint32_t cell);
  // True if a segment of the cell lies within the error of the point, or a ball within the error of its surface.
  // Usually O(1).
  bool isNear(CellPieces& cell, const Vector3d& p_W) const;
  // Marks the segments of the cell whose middles lie within the error of this full-resolution segment. Usually O(1).
  void reach(CellPieces& cell, const Vector3d& a_W, const Vector3d& b_W);

  std::uint64_t unreached() const;

 private:
  void indexCell(CellPieces& cell);

  double error_um_, error_um2_;
  std::vector<Piece> pieces_;      // by cell
  std::vector<CellPieces> cells_;  // ascending
  HashedCubes near_, middles_;     // middles_: only pieces that are not reached
};

}  // namespace filiform::internal
