// The tile finder: finds the tiles that may hold something near a point, without reading them.
//
// It uses hierarchies of boxes (internal/box_levels.h) on three levels: over the store's groups, over the pages of each
// group, and over the tiles of each page. A hierarchy is built when a query first enters the group or page, so that
// opening is independent of the number of tiles. Sets of up to 64 tiles are scanned. Boxes are widened by one quantum
// and distances rounded down, so that no tile is missed. The long-segment tile is not included. Thread rule: internally
// synchronised.
#pragma once

#include "index/set/tile_store.h"
#include "index/tile/tile_engine.h"

#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace filiform {

class TileFinder {
 public:
  static constexpr TileId kScanTiles = 64;  // sets of up to this many tiles are scanned

  // A tile found near a point.
  struct Hit {
    TileId tile;
    double squared_distance;  // um^2 from the query to the tile's box, rounded down

    bool operator<(const Hit& other) const {
      return squared_distance != other.squared_distance ? squared_distance < other.squared_distance : tile < other.tile;
    }
  };

  // The store must outlive this object. O(pages). The first query is O(groups), plus O(pages of the group) for each
  // group and O(tiles of the page) for each page that it enters. Every member throws what the store throws when it
  // reads a page; the next call tries again.
  explicit TileFinder(const TileStore& store);
  // Only these tiles, with content in these boxes instead of those of the directory. O(tiles).
  TileFinder(const TileStore& store, std::vector<std::pair<TileId, WorldBox>> tiles);
  ~TileFinder();

  // All tiles with content whose box lies within `squared_bound` (um^2, closed) of h_W, nearest first, ties by id.
  // Requires finite h_W. O(log tiles + hits log hits).
  std::vector<Hit> within(const Vector3d& h_W, double squared_bound) const;

  // All tiles with content whose box may meet the region, ascending by id, each with its widened box. O(log tiles +
  // hits log hits).
  std::vector<std::pair<TileId, WorldBox>> meeting(const Region& region) const;
  // From a set at an address, enters the groups and pages that meeting() enters, many at once, as meeting() does.
  // Does nothing for a set in a folder.
  void readPages(const Region& region) const;

  // Returns tiles with content one by one, nearest first, ties by id. Requires finite h_W. The TileFinder must outlive
  // it. Thread rule: thread-compatible.
  class Walk {
   public:
    ~Walk();
    Walk(Walk&&) noexcept;
    // The next tile within the squared bound (um^2, closed); nullopt after the last. A bound may not be larger than
    // the bound of an earlier call: what lies beyond is forgotten. O(log tiles) amortised.
    std::optional<Hit> next(double squared_bound = std::numeric_limits<double>::infinity());

   private:
    friend class TileFinder;
    struct State;
    explicit Walk(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
  };
  Walk walk(const Vector3d& h_W) const;

  // True if h_W lies outside the box of all tiles.
  bool isOutside(const Vector3d& h_W) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
