// Finds a place for the proxy from a name, a point or a line of sight. Thread rule: internally synchronised. Reads the
// disk, so do not use it on the thread that draws or on the haptic thread.
#pragma once

#include "index/query/nearest.h"
#include "solver/proxy/proxy_solver.h"
#include "solver/travel/places/cell_search.h"
#include "solver/travel/places/cell_walk.h"
#include "solver/travel/places/junction.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace filiform {

class PlaceFinder {
 public:
  struct Picked {
    ProxyPlace place;
    double along_um = 0;     // ray: distance from the eye
    double distance_um = 0;  // from the point or the ray
  };

  // The store must outlive the finder. `options`: of its search. Throws UsageError as Nearest does.
  explicit PlaceFinder(const TileStore& store, const NearestOptions& options = {});
  ~PlaceFinder();

  // Nullopt if the ray hits nothing, or if the scene is empty. Throws CorruptTile, CorruptSet, IoError from the store;
  // UsageError as Nearest does.
  // `sees`: only of cells for which it returns true; empty: of all.
  std::optional<Picked> along(const RayQuery& ray, const std::function<bool(std::uint32_t cell)>& sees = {}) const;
  std::optional<Picked> nearest(const Vector3d& p_W) const;
  // The nearest segment of those in the home tile of a point: reads this tile, and pages of the directory. Others may
  // be nearer. Without a home tile, or if it has no segment: nearest(). O(segments of the tile).
  std::optional<Picked> anyNear(const Vector3d& p_W) const;
  // The place of sample `node` (rank) of a cell that walk() has read.
  ProxyPlace atSample(const CellWalk& walk, std::uint32_t cell, std::uint32_t node) const;
  // A place on a cell that walk() has read. Reads its tile.
  ProxyPlace at(const CellWalk& walk, std::uint32_t cell, const CellPlace& place) const;
  // Reads the cell as readCell() does. O(segments of the cell).
  std::shared_ptr<const CellWalk> walk(std::uint32_t cell, const std::atomic<bool>* stop = nullptr) const;
  // The place that the user asks for. Throws UsageError, with a line for the user, if there is none.
  ProxyPlace find(const CellQuery& query) const;
  // The cell's soma, without a soma its first root, on the segment there with the lowest id. Reads tiles of the cell
  // until the root is found. Throws InputError if the set is damaged.
  ProxyPlace soma(std::uint32_t cell) const;
  // The fork next to a place; see findJunction(). Reads at most 65 tiles, apart from those of somata.
  std::optional<Junction> junction(const ProxyPlace& place, const Vector3d& heading_W, double reach_um,
                                   double length_um) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
