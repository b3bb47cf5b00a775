// CellIntake: takes the cells of an ingest one by one. It checks each cell, makes its record, encodes its detail into
// the spool, and passes its segments on.
#pragma once

#include "index/build/internal/chunks.h"
#include "index/build/internal/level_writer.h"
#include "index/build/internal/stored_cells.h"
#include "index/cell/cell.h"
#include "index/set/internal/attributes_section.h"
#include "index/set/landmarks.h"
#include "index/set/tile_store.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform::internal {

// Thread rule: thread-compatible. Throws IoError if the spool cannot be written or read.
class CellIntake {
 public:
  CellIntake(const Grid& grid, Spool& spool) : grid_(grid), details_(spool) {}

  // Takes what it needs from `cell`; frees the arrays of a large cell early. Throws UsageError if the cell's arrays
  // contradict each other, InputError if there are too many cells, samples or links. O(samples).
  void take(Cell& cell, Chunks& chunks, LandmarkSurvey& survey);
  // Takes a cell of an existing set, without its segments. O(bytes of its detail).
  void take(StoredCells::One cell);
  // For another rank: passes on all cells and frees them. Call keepForOthers() before the first cell.
  void keepForOthers() { for_others_ = true; }
  void handOver(ByteChain& out);
  // Takes the cells that another rank handed over.
  void take(ByteChain& handed_over);
  // Names the cells. Call it once, after the last cell.
  void finish();

  const std::vector<CellRecord>& records() const { return records_; }     // names: after finish()
  const std::vector<std::uint64_t>& digests() const { return digests_; }  // by cell
  const std::vector<SomaRoot>& somata() const { return somata_; }         // root samples of type soma
  const AttributeTable& attributes() const { return attributes_; }
  GridBox bounds() const;                                               // of all samples. O(cells)
  std::uint64_t segments() const { return segments_; }                  // isolated ones included
  std::uint64_t bytes() const { return bytes_ + attributes_.bytes(); }  // estimated memory of all records
  // Moves the details to a file if they take more than `most_bytes`. Call it after finish(). Throws IoError.
  void limitDetails(std::uint64_t most_bytes);
  // Calls `use` for each cell with its detail from encodeDetail(), without the number of tiles, and frees the detail.
  // Call it at most once, after finish().
  void readDetails(const std::function<void(std::uint32_t cell, ByteSpan detail)>& use);

 private:
  void findSomata(const Cell& cell, const CellDetail& detail);
  void snap(const Cell& cell, CellRecord& record);
  void findChildren(const Cell& cell);
  void passSegments(const Cell& cell, CellRecord& record, Chunks& chunks, LandmarkSurvey& survey);
  void keepDetail(const CellDetail& detail);
  void keepBytes(ByteSpan detail);

  Grid grid_;
  ByteChain details_;  // each after its size
  std::vector<CellRecord> records_;
  std::vector<std::uint64_t> digests_;
  std::vector<std::string> given_names_;
  std::vector<SomaRoot> somata_;
  AttributeTable attributes_;
  bool for_others_ = false;
  std::vector<std::vector<CellAttribute>> given_attributes_;  // by cell, for another rank
  std::uint64_t segments_ = 0, bytes_ = 0;
  std::vector<GridPoint> snapped_;      // of the current cell
  std::vector<std::uint8_t> is_child_;  // of the current cell: 1: child of a segment; 2: parent of one in a forest
};

}  // namespace filiform::internal
