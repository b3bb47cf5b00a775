// OpenSet: an open revision of a tile set with what queries from Python need. Thread rule: internally synchronised.
#pragma once

#include "index/levels/levels.h"
#include "index/measure/segment_looks.h"
#include "index/query/filtered_searches.h"
#include "index/query/kept_tiles.h"
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "tools/words/sample_ids.h"

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace filiform::python {

class OpenSet {
 public:
  // `budget_bytes`: of tiles kept between queries, a quarter more for cells read one by one, a quarter more of sample
  // ids, a quarter more for queries with filters, and a sixteenth more for types and radii. Throws as TileSet::open().
  // `revision`: empty for the newest.
  OpenSet(const std::string& name, const std::string& revision, const RemoteOptions& remote,
          std::uint64_t budget_bytes);

  const TileSet& set() const { return *set_; }
  const TileStore& kept() const { return kept_; }  // the set, whose tiles stay in memory: to read cells one by one
  const Nearest& nearest() const { return nearest_; }
  FilteredSearches& filtered() const { return filtered_; }
  SegmentLooks& looks() const { return looks_; }
  // The id in the file of a segment's child sample. O(1) for the cell that this thread asked for last. Throws
  // CorruptSet, IoError.
  std::int64_t sampleOf(const SegmentId& segment) const;
  // Reads what sampleOf() needs for these results; see SampleIds::readAhead().
  template <typename Results>
  void readAhead(const Results& results) const {
    sample_ids_.readAhead(results);
  }
  // nullptr: the set has none. Opened at the first call, O(tiles). Throws CorruptSet, IoError.
  const Levels* levels() const;

 private:
  const std::unique_ptr<const TileSet> set_;
  const KeptTiles kept_;
  const Nearest nearest_;
  mutable FilteredSearches filtered_;
  mutable SegmentLooks looks_;
  mutable tools::SampleIds sample_ids_;
  const std::uint64_t serial_;  // different for each object of the process
  mutable std::mutex levels_mutex_;
  mutable std::optional<std::unique_ptr<const Levels>> levels_;  // nullopt until they are opened
};

}  // namespace filiform::python
