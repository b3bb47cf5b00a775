// From what a person names or points at to a place that the proxy can be put to. Thread rule: internally synchronised;
// reads the disk, so not for the thread that draws, nor the haptic one.
#pragma once

#include "index/query/nearest.h"
#include "solver/proxy/proxy_solver.h"
#include "solver/travel/cell_search.h"
#include "solver/travel/cell_walk.h"
#include "solver/travel/junction.h"

#include <memory>
#include <optional>
#include <string>

namespace filiform {

class PlaceFinder {
 public:
  struct Picked {
    ProxyPlace place;
    double along_um = 0;     // of a ray: from the eye
    double distance_um = 0;  // from the point, or from the ray
  };

  explicit PlaceFinder(const TileStore& store);  // which must outlive it
  ~PlaceFinder();

  // None where nothing is hit, or the scene is empty. Throws CorruptTile, CorruptSet, IoError from the store;
  // UsageError as Nearest does.
  std::optional<Picked> along(const RayQuery& ray) const;
  std::optional<Picked> nearest(const Vector3d& p_W) const;
  // At a sample of a cell that was read.
  ProxyPlace atSample(const CellWalk& walk, std::uint32_t cell, std::uint32_t node) const;
  // Reads the cell. O(its segments).
  std::shared_ptr<const CellWalk> walk(std::uint32_t cell) const;
  // Where that leads; throws UsageError with a line for the person where it leads nowhere.
  ProxyPlace find(const CellQuery& query) const;
  // The cell's soma, else the root of its longest tree.
  ProxyPlace soma(std::uint32_t cell) const;
  // The fork next to a place, see findJunction. Reads at most 64 tiles.
  std::optional<Junction> junction(const ProxyPlace& place, const Vector3d& heading_W, double reach_um,
                                   double length_um) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
