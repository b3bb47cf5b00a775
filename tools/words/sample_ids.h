// SampleIds: the sample ids of the cells that queries find, kept for later queries within a byte budget.
// Thread rule: internally synchronised.
#pragma once

#include "index/cell/id_runs.h"

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>
#include <vector>

namespace filiform {
class TileStore;
}

namespace filiform::tools {

// The id of the child sample of each segment of a cell. Throws CorruptSet, IoError. O(bytes of the cell's detail); for
// a cell with loops it reads the cell's tiles.
IdRuns childSampleIds(const TileStore& store, std::uint32_t cell);

class SampleIds {
 public:
  // The store must outlive this object.
  SampleIds(const TileStore& store, std::uint64_t budget_bytes) : store_(store), budget_bytes_(budget_bytes) {}
  void setBudget(std::uint64_t budget_bytes);

  // The ids of one cell.
  class OfCell {
   public:
    OfCell(std::uint32_t cell, IdRuns ids) : cell_(cell), ids_(std::move(ids)) {}
    // The id of the segment's child sample. Throws CorruptSet if the cell has no such segment. O(log runs of ids).
    std::int64_t of(std::uint32_t segment) const;
    std::uint64_t bytes() const { return sizeof(OfCell) + ids_.bytes(); }

   private:
    std::uint32_t cell_;
    IdRuns ids_;
  };
  // Throws as childSampleIds() does. O(1) if the cell is kept.
  std::shared_ptr<const OfCell> cell(std::uint32_t cell);
  // From a set at an address, reads the ids of cells, many at once, for calls of cell() that follow. A cell that cannot
  // be read is left to cell().
  void readAhead(std::vector<std::uint32_t> cells);
  // The same for the cells of the results of a query.
  template <typename Result>
  void readAhead(const std::vector<Result>& results) {
    std::vector<std::uint32_t> cells;
    for (const Result& result : results) cells.push_back(result.segment.cell);
    readAhead(std::move(cells));
  }
  template <typename Result>
  void readAhead(const std::vector<std::vector<Result>>& results) {
    std::vector<std::uint32_t> cells;
    for (const auto& some : results)
      for (const Result& result : some) cells.push_back(result.segment.cell);
    readAhead(std::move(cells));
  }

  std::uint64_t bytes() const;

 private:
  struct Kept {
    std::shared_ptr<const OfCell> ids;
    std::list<std::uint32_t>::iterator place;
  };
  const TileStore& store_;
  void trim();
  std::uint64_t budget_bytes_;  // under the mutex
  mutable std::mutex mutex_;
  std::list<std::uint32_t> order_;  // most recent first
  std::unordered_map<std::uint32_t, Kept> kept_;
  std::uint64_t bytes_ = 0;
};

}  // namespace filiform::tools
