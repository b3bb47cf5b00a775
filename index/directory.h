// Where the tiles are: which of them may hold something near a point, without reading any.
//
// CGAL AABB trees over the tiles' boxes in two levels: one over the store's pages, and one for each page, built when
// a query first enters it, so that opening does not depend on the number of tiles. Sets of up to 64 tiles are scanned
// and build no tree. Boxes are widened by one quantum and distances rounded down: a tile is never missed. The
// long-segment tile is not in here. Thread rule: internally synchronised.
#pragma once

#include "index/tile_engine.h"
#include "index/tile_store.h"

#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace filiform {

class Directory {
 public:
  struct Hit {
    TileId tile;
    double squared_distance;  // um^2 from the query to the tile's box, rounded down

    bool operator<(const Hit& other) const {
      return squared_distance != other.squared_distance ? squared_distance < other.squared_distance : tile < other.tile;
    }
  };

  // The store must outlive it. O(pages); the first query is O(pages log pages), and O(page log page) for each page that
  // it enters. Every member throws what the store throws when it reads a page; the next call then tries again.
  explicit Directory(const TileStore& store);
  ~Directory();

  // All tiles with content whose box lies within `squared_bound` (um^2, closed) of h, nearest first, ties by id.
  // Requires finite h. O(log tiles + hits log hits).
  std::vector<Hit> within(const Vector3d& h_W, double squared_bound) const;

  // All tiles with content whose box may meet the region, ascending, with the box as `within` sees it. O(log tiles +
  // hits log hits).
  std::vector<std::pair<TileId, WorldBox>> meeting(const Region& region) const;

  // Tiles one by one, nearest first, ties by id: for points far outside, and where no bound is known. The directory
  // must outlive it. Thread-compatible.
  class Walk {
   public:
    ~Walk();
    Walk(Walk&&) noexcept;
    // Nothing when all tiles were given. O(log tiles) amortised.
    std::optional<Hit> next();

   private:
    friend class Directory;
    struct State;
    explicit Walk(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
  };
  Walk walk(const Vector3d& h_W) const;

  // Does h lie outside the box of all tiles?
  bool isOutside(const Vector3d& h_W) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
