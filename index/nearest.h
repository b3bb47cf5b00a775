// The nearest segments of a tile set to a point: exact, within a stated error,
// or from what is in memory.
//
//   TileSet set("column.fil");
//   Nearest nearest(set);
//   for (const NearestResult& r : nearest.find(Vector3d(120, -40, 800), {.k =
//   3}))
//     std::cout << set.cell(r.segment.cell).name << " at " << r.distance_um <<
//     " um\n";
//
// Exact means: of the gridded data, in double, every distance by
// closestPoint(), ties to the lowest (cell, segment); so answers depend neither
// on the tiling, nor on the engine, nor on what is in memory. As few tiles are
// read as the geometry allows: FLANN over the set's samples bounds the
// distance, the CGAL directory lists the tiles within the bound, and they are
// searched nearest first. Sets of up to 64 tiles use neither. Thread rule:
// internally synchronised; not for the haptic thread.
#pragma once

#include "index/tile_store.h"

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace filiform {

struct NearestOptions {
  std::string engine = "cgal";             // inside a tile; tile_engine.h names what is built
  std::uint64_t budget_bytes = 256 << 20;  // tiles and their engines kept between queries; the
                                           // long-segment tile always is
};

struct NearestQuery {
  std::size_t k = 1;           // results wanted; 0: none
  double epsilon = 0;          // each rank may be (1 + epsilon) times too far, and no
                               // more; saves tiles and time
  bool approximate = false;    // from the samples alone: no tile is read, the
                               // error is at most Nearest::covering_radius_um()
  bool resident_only = false;  // reads nothing: searches the tiles that earlier
                               // queries left in memory
  double max_distance_um = std::numeric_limits<double>::infinity();  // closed; with k = SIZE_MAX: all
                                                                     // within a radius
};

struct NearestResult {
  std::uint32_t rank;  // from 0
  double distance_um;
  Vector3d p_W;  // the nearest point of the segment; approximate: the sample
  SegmentId segment;
  double t;                      // where on it: 0 child .. 1 parent
  TileId tile;                   // a tile that stores the segment; approximate: kNoTile
  bool exact;                    // this is surely the result of that rank
  std::uint32_t tiles_read;      // by the whole query, from the store
  std::uint32_t tiles_searched;  // by the whole query, read or not
};

class Nearest {
 public:
  // Coordinates beyond this cannot be squared safely.
  static constexpr double kMaxCoordinate_um = 1e150;

  // O(1): reads and builds nothing before the first query. The store must
  // outlive it. Throws UsageError for an unknown engine.
  explicit Nearest(const TileStore& store, const NearestOptions& options = {});
  ~Nearest();

  // At most k results, best first; none from an empty set. Throws UsageError
  // for coordinates that are NaN, infinite or beyond kMaxCoordinate_um, for an
  // epsilon that is negative or not finite, for a max_distance_um that is
  // negative or NaN; CorruptTile, CorruptSet, IoError from the store. O(log
  // segments + k) and one or two tiles read, expected.
  std::vector<NearestResult> find(const Vector3d& h_W, const NearestQuery& query = {}) const;

  // The stated error of approximate answers. The first call reads the samples.
  double covering_radius_um() const;

  // Tiles and engines in memory now.
  std::uint64_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
