// The objects behind the handles of filiform.h. Thread rule: internally synchronised, except OpenTravel.
#pragma once

#include "index/query/cell_paths.h"
#include "index/query/kept_tiles.h"
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "solver/travel/session/stepped_travel.h"
#include "tools/c/call.h"
#include "tools/words/sample_ids.h"

#include <atomic>
#include <memory>
#include <utility>
#include <vector>

namespace filiform::c {

struct OpenSet {
  OpenSet(std::unique_ptr<TileSet> opened, const NearestOptions& options)
      : set(std::move(opened)), kept(*set, kKeptBytes), nearest(kept, options), samples(*set, kSampleBytes) {}

  static constexpr std::uint64_t kKeptBytes = std::uint64_t{64} << 20, kSampleBytes = std::uint64_t{64} << 20;

  // Throws UsageError if the set has no such cell.
  void requireCell(std::uint32_t cell) const;

  std::unique_ptr<TileSet> set;
  KeptTiles kept;  // for cells one by one; searches take the tiles that are here
  Nearest nearest;
  tools::SampleIds samples;
};

struct OpenCell {
  explicit OpenCell(CellGraph graph);

  // Throws UsageError for a place that the cell does not have. `name`: of the argument.
  CellPlace place(const filiform_place& place, const char* name) const;

  CellPaths paths;
  std::vector<double> points_um;    // x, y, z of each sample
  std::vector<std::uint32_t> ends;  // child and parent of each segment
};

struct OpenTravel {
  OpenTravel(std::shared_ptr<OpenSet> opened, const SteppedTravelOptions& options)
      : scene(std::move(opened)), travel(*scene->set, options) {}

  std::shared_ptr<OpenSet> scene;
  SteppedTravel travel;
  std::atomic<bool> busy{false};
  std::uint32_t jumped_cell = FILIFORM_NONE;  // whose graph is kept for the next jump
  std::unique_ptr<OpenCell> jumped;
};

// Sets are shared by the travels in them.
using SetHandle = std::shared_ptr<OpenSet>;
using HeldSet = Held<SetHandle, HandleKind::set>;
using HeldCell = Held<OpenCell, HandleKind::cell>;

}  // namespace filiform::c
