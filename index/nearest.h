// The nearest segments of a tile set to a point: exact, within a stated error, or from what is in memory.
//
//   const auto set = TileSet::open("column.fil");
//   const Nearest nearest(*set);
//   for (const NearestResult& r : nearest.find(Vector3d(120, -40, 800), {.k = 3}))
//     std::cout << set->cell(r.segment.cell).name << " at " << r.distance_um << " um\n";
//
// Exact means: of the gridded data, in double, every distance by closestPoint(), ties to the lowest (cell, segment); so
// answers depend neither on the tiling, nor on the engine, nor on what is in memory. As few tiles are read as the
// geometry allows. A point within the content of a tile is looked for there first, and mostly nowhere else; elsewhere
// FLANN over the set's samples bounds the distance; the CGAL directory lists the tiles within the bound, and they are
// searched nearest first. Sets of up to 64 tiles need none of this. Thread rule: internally synchronised; not for the
// haptic thread.
#pragma once

#include "index/tile_store.h"

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform {

struct NearestOptions {
  std::string engine = "packed";           // inside a tile; tile_engine.h names what is built
  std::uint64_t budget_bytes = 256 << 20;  // tiles and their engines kept between queries; the long-segment tile too
};

struct NearestQuery {
  std::size_t k = 1;           // results wanted; 0: none
  double epsilon = 0;          // each rank may be (1 + epsilon) times too far, and no more; saves tiles and time
  bool approximate = false;    // from the samples alone, no tile is read: off by covering_radius_um() at most
  bool resident_only = false;  // reads nothing: searches the tiles that earlier queries left in memory
  double max_distance_um = std::numeric_limits<double>::infinity();  // closed; k = SIZE_MAX: all within it
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

// A line of sight with some tolerance: a segment is hit where it comes closest to the ray, if that is at most radius +
// slope * (distance along the ray) away.
struct RayQuery {
  Vector3d origin_W, direction;  // of any length but 0
  double radius_um = 0;          // of the cylinder
  double slope = 0;              // of the cone: a radius of one pixel, say, at a distance of 1
  double length_um = std::numeric_limits<double>::infinity();  // hits lie no farther along the ray
  std::size_t most = SIZE_MAX;                                 // results wanted
};

struct RayHit {
  double along_um;     // from the origin to where the segment comes closest
  double distance_um;  // from there to the segment
  Vector3d p_W;        // on the segment
  SegmentId segment;
  double t;                                  // where on it: 0 child .. 1 parent
  TileId tile;                               // a tile that stores the segment
  std::uint32_t tiles_read, tiles_searched;  // by the whole query
};

class Nearest {
 public:
  // Coordinates beyond this cannot be squared safely.
  static constexpr double kMaxCoordinate_um = 1e150;

  // O(1): reads and builds nothing before the first query. The store must outlive it. Throws UsageError for an unknown
  // engine.
  explicit Nearest(const TileStore& store, const NearestOptions& options = {});
  ~Nearest();

  // At most k results, best first; none from an empty set. Throws UsageError for coordinates that are NaN, infinite or
  // beyond kMaxCoordinate_um, for an epsilon that is negative or not finite, for a max_distance_um that is negative or
  // NaN; CorruptTile, CorruptSet, IoError from the store. O(log segments + k) and one or two tiles read, expected.
  std::vector<NearestResult> find(const Vector3d& h_W, const NearestQuery& query = {}) const;

  // find() for each of the points, in their order; visits them along a space-filling curve, so that tiles are met once,
  // on `threads` threads (at least one). Throws what find() throws. O(points) times find().
  std::vector<std::vector<NearestResult>> findAll(std::span<const Vector3d> points, const NearestQuery& query = {},
                                                  unsigned threads = 1) const;

  // All segments that meet the closed box, decided exactly for the corners as rounded to the grid; as find() would rank
  // them from the middle of the box. Throws UsageError for corners that are not finite or out of order. O(log segments
  // + tiles and segments that meet the box).
  std::vector<NearestResult> inBox(const Vector3d& lo_W, const Vector3d& hi_W) const;

  // The segments hit by a ray, the first along it first, ties by (cell, segment); tiles are searched along the ray,
  // only until `most` hits are sure. Throws UsageError for what is not finite or a direction of length 0. O(log
  // segments + what lies along the ray).
  std::vector<RayHit> alongRay(const RayQuery& ray) const;

  // The stated error of approximate answers. The first call reads the samples.
  double covering_radius_um() const;

  // Tiles and engines in memory now.
  std::uint64_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
