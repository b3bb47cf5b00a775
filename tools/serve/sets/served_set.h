// ServedSet: one revision of a set with what its queries need. SetShelf holds the current ones.
// Thread rule: internally synchronised.
#pragma once

#include "index/attributes/cell_attributes.h"
#include "index/export/cell_numbers.h"
#include "index/levels/levels.h"
#include "index/measure/segment_looks.h"
#include "index/query/filtered_searches.h"
#include "index/query/kept_tiles.h"
#include "index/query/nearest.h"
#include "index/query/tile_finder.h"
#include "index/set/tile_set.h"
#include "tools/serve/sets/catmaid_space.h"
#include "tools/serve/sets/timed_store.h"
#include "tools/words/sample_ids.h"

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace filiform::tools {

class ServedSet {
 public:
  // Opens the set's current revision. Of the budget, three eighths are for the tiles of searches, an eighth for those
  // of searches with filters, three sixteenths for those of cells, a sixteenth for those that tell types and radii, and
  // a quarter for sample ids. Throws as TileSet::open() and
  // Levels::open() do.
  // `open_files`: of a folder that stay open; 0: half of the process's limit.
  ServedSet(std::string name, const std::string& path, std::uint64_t budget_bytes, const RemoteOptions& remote = {},
            std::size_t open_files = 0);

  const std::string& name() const { return name_; }
  // Keeps in memory, of what searches need, so many bytes from now on. O(what goes).
  void setBudget(std::uint64_t budget_bytes) const;
  const TileSet& set() const { return *set_; }
  const std::shared_ptr<const TileSet>& sharedSet() const { return set_; }
  const Levels* levels() const { return levels_.get(); }  // nullptr: the set has none
  const TimedStore& store() const { return store_; }      // the set, with the time limit of answers
  const TileStore& kept() const { return kept_; }         // likewise; its tiles stay in memory: for readCell()
  const CellAttributes& attributes() const { return attributes_; }
  const Nearest& nearest() const { return nearest_; }
  FilteredSearches& filtered() const { return filtered_; }
  const TileFinder& finder() const { return finder_; }
  SampleIds& sampleIds() const { return sample_ids_; }
  SegmentLooks& looks() const { return looks_; }
  // Made at the first call. Throws as CellNumbers() does, and AnswerTimeout.
  const CellNumbers& cellNumbers() const;
  const CatmaidSpace& catmaidSpace() const;  // likewise, as CatmaidSpace()

  // The stored segments of the tiles that may meet the closed box. Throws CorruptSet, IoError.
  std::uint64_t segmentsAround(const Vector3d& lo_W, const Vector3d& hi_W) const;

 private:
  const std::string name_;
  const std::shared_ptr<const TileSet> set_;
  const std::unique_ptr<const Levels> levels_;
  const CellAttributes attributes_;
  const TimedStore store_;
  mutable KeptTiles kept_;
  const Nearest nearest_;
  mutable FilteredSearches filtered_;
  const TileFinder finder_;
  mutable SampleIds sample_ids_;
  mutable SegmentLooks looks_;
  mutable std::mutex late_mutex_;  // of what follows
  mutable std::optional<CellNumbers> numbers_;
  mutable std::optional<CatmaidSpace> catmaid_;
};

}  // namespace filiform::tools
