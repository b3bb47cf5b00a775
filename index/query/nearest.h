// Finds the nearest segments of a tile set to a point: exactly, within a stated error, or among the tiles in memory.
//
//   const auto set = TileSet::open("column.fil");
//   const Nearest nearest(*set);
//   for (const NearestResult& r : nearest.find(Vector3d(120, -40, 800), {.k = 3}))
//     std::cout << set->cell(r.segment.cell).name << " at " << r.distance_um << " um\n";
//
// Exact means: for positions on the grid, in double, with every distance by closestPoint() and ties to the lowest
// (cell, segment). So the result depends neither on the tiling, nor the engine, nor the tiles in memory.
//
// A filter is part of the search: tiles without a wanted type or cell are not read. For a few cells (at most 1024, with
// at most a 16th of the segments), the first query reads the tiles of these cells, and later ones search only these.
// For types, appearances are read too. A ghost's type is that in the tile which owns it; that tile is read if the ghost
// may be a result.
//
// Few tiles are read. A point inside the content of a tile is first searched there, which is usually enough. Other
// tiles are searched nearest first, as the tile finder lists them, until no other tile can hold a nearer segment.
// From a set at an address, tiles are read many at once: the tile of a point with the three nearest ones of its page of
// the directory, and the tiles that a box, a ray, a radius or the next points of a batch need. The results, with
// `tiles_read`, are those of a folder. Tiles that wait for their use take up to half of `budget_bytes`, or the space of
// 64 tiles, in addition.
// Thread rule: internally synchronised; the haptic thread must not call it.
#pragma once

#include "index/query/segment_filter.h"
#include "index/set/tile_store.h"
#include "index/tile/tile_engine_kind.h"

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace filiform {

namespace internal {
class SearchedSet;
}

// How a Nearest searches, and in which segments.
struct NearestOptions {
  TileEngineKind engine = TileEngineKind::packed;  // inside a tile
  std::uint64_t budget_bytes = 256 << 20;  // for tiles and engines kept between queries, the long-segment tile included
  SegmentFilter filter{};                  // all other segments are as if they did not exist
};

// What find() looks for.
struct NearestQuery {
  std::size_t k = 1;           // number of results; 0: none
  double epsilon = 0;          // each rank may be up to (1 + epsilon) times too far; saves tiles and time
  bool approximate = false;    // use only the landmarks, read no tile: error at most covering_radius_um()
  bool resident_only = false;  // read nothing: search only tiles that earlier queries left in memory
  double max_distance_um = std::numeric_limits<double>::infinity();  // closed; k = SIZE_MAX: all within it
  bool of_cells = false;                                             // k cells, each by its nearest segment
  // Finds no segment of the point's own cell: the cell of the segment that is nearest to the point among all segments
  // of the set, whatever the filter; of equally near ones, the lowest (cell, segment). So a point on a neurite finds
  // other cells.
  bool other_cells = false;
};

// One segment that find() or inBox() returns.
struct NearestResult {
  std::uint32_t rank;  // from 0
  double distance_um;
  Vector3d p_W;  // the nearest point of the segment; approximate: the landmark
  SegmentId segment;
  double t;     // position on the segment: 0 child .. 1 parent
  TileId tile;  // a tile that stores the segment; approximate: kNoTile
  bool exact;   // true: certainly the segment of that rank
};

// What a query did. A visitor's search counts a tile in each round again.
struct SearchCounts {
  std::uint32_t tiles_read = 0;      // from the store
  std::uint32_t tiles_searched = 0;  // read or not

  SearchCounts& operator+=(const SearchCounts& other) {
    tiles_read += other.tiles_read;
    tiles_searched += other.tiles_searched;
    return *this;
  }
};

// Where a part of a box begins: at a hit in one of the tiles that meet the box.
struct BoxPlace {
  std::uint32_t tile = 0, hit = 0;
};

// A part of what lies in a box, and where the next part begins.
struct BoxPart {
  std::vector<NearestResult> results;
  std::optional<BoxPlace> next;  // nullopt: the box has no more
  SearchCounts counts;
};

// A line of sight with a tolerance. A segment is hit if its closest distance to the ray is at most radius_um + slope *
// (distance along the ray).
struct RayQuery {
  Vector3d origin_W, direction;  // of any length except 0
  double radius_um = 0;          // of the cylinder
  double slope = 0;              // of the cone: the radius grows by `slope` um for one um along the ray
  double length_um = std::numeric_limits<double>::infinity();  // hits lie within this distance along the ray
  std::size_t most = SIZE_MAX;                                 // number of results
  bool of_cells = false;                                       // each cell once, by its first hit
};

// One segment that alongRay() returns.
struct RayHit {
  double along_um;     // from the origin to the closest approach
  double distance_um;  // from the ray to the segment there
  Vector3d p_W;        // on the segment
  SegmentId segment;
  double t;     // position on the segment: 0 child .. 1 parent
  TileId tile;  // a tile that stores the segment

  bool operator<(const RayHit& other) const {
    return along_um != other.along_um ? along_um < other.along_um : segment < other.segment;
  }
};

class Nearest {
 public:
  // Largest coordinate that can be squared safely.
  static constexpr double kMaxCoordinate_um = 1e150;

  // O(1), and O(cells) with a filter of cells: reads and builds nothing before the first query. The store must outlive
  // this object. Throws UsageError for a filter with cells that do not ascend or exist.
  explicit Nearest(const TileStore& store, const NearestOptions& options = {});
  ~Nearest();

  // Returns at most k segments, nearest first; none from an empty set. Throws UsageError if a coordinate is not finite
  // or exceeds kMaxCoordinate_um, if epsilon is negative or not finite, if max_distance_um is negative or NaN, or if
  // `approximate` comes with a filter, of_cells or other_cells. With other_cells, a search with a filter keeps tiles of
  // up to half of `budget_bytes` more. Throws CorruptTile, CorruptSet, IoError from the store. Expected: O(log segments
  // + k) and one or two tiles read.
  std::vector<NearestResult> find(const Vector3d& h_W, const NearestQuery& query = {}) const;
  // The same into the caller's list, whose content is replaced. Does not allocate once lists have grown, if k = 1 and
  // all tiles are in memory.
  SearchCounts find(const Vector3d& h_W, const NearestQuery& query, std::vector<NearestResult>& results) const;

  // Calls visit() for one segment after the other, nearest first, until it returns false. The query's k is not used.
  // Searches for 8 segments, then for four times as many: up to five times as many as are visited. Throws as find(),
  // and UsageError if epsilon is not 0 or resident_only is set.
  SearchCounts forEachNearest(const Vector3d& h_W, const NearestQuery& query,
                              const std::function<bool(const NearestResult&)>& visit) const;

  // Calls find() for each point, on `threads` threads (at least one). Results have the order of the points. Points are
  // visited along a space-filling curve, so that consecutive points need the same tiles. Throws as find() does.
  // O(points) times find().
  std::vector<std::vector<NearestResult>> findAll(std::span<const Vector3d> points, const NearestQuery& query = {},
                                                  unsigned threads = 1) const;

  // The same without a list: calls visit(i, results of points[i], counts) once for each point, on the thread that
  // searched. At most `threads` calls run at once. Exceptions of `visit` end the search and propagate.
  void forEach(std::span<const Vector3d> points, const NearestQuery& query, unsigned threads,
               const std::function<void(std::size_t i, std::vector<NearestResult>&& results,
                                        const SearchCounts& counts)>& visit) const;

  // Returns all segments that meet the closed box, ranked as find() ranks them from the middle of the box. The corners
  // are rounded to the grid; the test is then exact. Throws UsageError for corners that are not finite or out of order.
  // `of_cells`: each cell once, by its segment nearest to the middle. O(log segments + tiles and segments that meet the
  // box).
  std::vector<NearestResult> inBox(const Vector3d& lo_W, const Vector3d& hi_W, bool of_cells = false) const;
  // The same into the caller's list, whose content is replaced.
  SearchCounts inBox(const Vector3d& lo_W, const Vector3d& hi_W, bool of_cells,
                     std::vector<NearestResult>& results) const;

  // Calls visit() for each segment that inBox() finds, in the set's own order, with ranks in that order, until it
  // returns false. Keeps the segments of one tile at a time. Throws and costs as inBox().
  SearchCounts forEachInBox(const Vector3d& lo_W, const Vector3d& hi_W,
                            const std::function<bool(const NearestResult&)>& visit) const;

  // The number of segments that inBox() finds, by cell, ascending. `by_middle`: only those whose middle, rounded down
  // to the grid, is at least lo_W and below hi_W on each axis; so boxes side by side count each segment once. Throws as
  // inBox(). O(log segments + tiles and segments that meet the box).
  std::map<std::uint32_t, std::uint64_t> countInBox(const Vector3d& lo_W, const Vector3d& hi_W,
                                                    bool by_middle = false) const;

  // Returns a part of the segments that inBox() finds, in the set's own order: those from `from`, at most `most`, and
  // of no more tiles once `ends()` is true, but of one tile at least. The parts of a box, each from the `next` of the
  // one before, hold each of its segments once, if the set and the filter are the same. Ranks are those within the
  // part. Throws UsageError as inBox() does. O(log segments + tiles that meet the box + segments of the part's tiles).
  BoxPart partOfBox(const Vector3d& lo_W, const Vector3d& hi_W, BoxPlace from, std::size_t most,
                    const std::function<bool()>& ends = {}) const;

  // Returns the segments hit by a ray, the first along it first, ties by (cell, segment). Searches tiles along the ray,
  // and stops as soon as `most` hits are certain. Throws UsageError for values that are not finite or a direction of
  // length 0. O(log segments + content along the ray).
  std::vector<RayHit> alongRay(const RayQuery& ray) const;
  // The same into the caller's list, whose content is replaced.
  SearchCounts alongRay(const RayQuery& ray, std::vector<RayHit>& hits) const;

  // Calls visit() for one hit after the other along the ray, until it returns false. The query's `most` is not used.
  // Throws as alongRay(), and searches in rounds as forEachNearest().
  SearchCounts forEachAlongRay(const RayQuery& ray, const std::function<bool(const RayHit&)>& visit) const;

  // The error bound of approximate results. The first call reads the landmarks.
  double covering_radius_um() const;

  // The store, with the tiles in memory: load() reads only others, and does not change leaves(). Lives as this object.
  const TileStore& tiles() const;

  // Keeps tiles and engines up to so many bytes from now on, as NearestOptions::budget_bytes says. O(tiles that go).
  void setBudget(std::uint64_t budget_bytes) const;

  // Bytes of the tiles and engines in memory now.
  std::uint64_t bytes() const;

 private:
  std::unique_ptr<internal::SearchedSet> set_;
  std::unique_ptr<internal::SearchedSet> all_;  // tells own cells; null without a filter
};

}  // namespace filiform
