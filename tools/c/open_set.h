// The objects behind the handles of filiform.h. Thread rule: internally synchronised, except OpenTravel.
#pragma once

#include "index/attributes/cell_attributes.h"
#include "index/levels/levels.h"
#include "index/query/cell_paths.h"
#include "index/query/kept_tiles.h"
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "solver/travel/session/stepped_travel.h"
#include "tools/c/call.h"
#include "tools/words/sample_ids.h"

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace filiform::c {

// The files of a set, shared by its views.
struct SetFiles {
  explicit SetFiles(std::unique_ptr<TileSet> opened)
      : set(std::move(opened)), kept(*set, kKeptBytes), samples(*set, kSampleBytes) {}

  static constexpr std::uint64_t kKeptBytes = std::uint64_t{64} << 20, kSampleBytes = std::uint64_t{64} << 20;

  const Levels* levels();  // nullptr: the set has none
  // The texts of an attribute by cell, nullptr: missing; kept. Throws UsageError for an unknown one.
  std::vector<const char*> texts(const std::string& name);
  // The column of an attribute. Throws UsageError for an unknown one.
  std::uint32_t column(const std::string& name);
  const CellAttributes& attributes();

  const std::unique_ptr<TileSet> set;
  const KeptTiles kept;  // for cells one by one; searches take the tiles that are here
  tools::SampleIds samples;

 private:
  std::mutex mutex_;
  std::optional<CellAttributes> attributes_;  // read at the first use, as levels_
  std::optional<std::unique_ptr<Levels>> levels_;
  std::map<std::uint32_t, std::set<std::string>> texts_;  // by column; each text once
};

struct OpenSet {
  OpenSet(std::shared_ptr<SetFiles> shared, const NearestOptions& options)
      : files(std::move(shared)), set(files->set.get()), nearest(files->kept, options), search(options) {}

  // Throws UsageError if the set has no such cell.
  void requireCell(std::uint32_t cell) const;

  const std::shared_ptr<SetFiles> files;
  const TileSet* const set;
  const Nearest nearest;
  const NearestOptions search;
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
