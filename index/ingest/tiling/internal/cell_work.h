// CellWork: takes cells apart, into what an ingest keeps of a cell (TakenCell) and its segments.
#pragma once

#include "index/attributes/internal/attributes_section.h"
#include "index/cell/cell.h"
#include "index/ingest/tiling/internal/chunks.h"
#include "index/ingest/tiling/landmarks.h"
#include "index/levels/internal/level_input.h"
#include "index/set/tile_store.h"

#include <cstdint>
#include <vector>

namespace filiform::internal {

struct TakenCell {
  CellRecord record;  // name: the given one
  std::uint64_t digest = 0;
  Bytes detail;                  // as encodeDetail() gives it, without tiles
  std::vector<SomaRoot> somata;  // of any cell id
  std::vector<CellAttribute> attributes;
};

// Thread rule: thread-compatible. Each thread has its own, with chunks of its own.
class CellWork {
 public:
  // Keeps a reference.
  CellWork(const Grid& grid, Chunks& chunks) : grid_(grid), chunks_(chunks) {}

  // Takes what it needs from `cell`, and frees the arrays of a large cell early. Throws UsageError if the cell's arrays
  // contradict each other, InputError if it has too many samples or links, IoError if the spool cannot be written.
  // O(samples).
  TakenCell take(Cell& cell, std::uint32_t id);
  const LandmarkSurvey& survey() const { return survey_; }  // the lengths of all segments so far
  const Chunks& chunks() const { return chunks_; }

 private:
  void findSomata(const Cell& cell, const CellDetail& detail, std::vector<SomaRoot>& found) const;
  void snap(const Cell& cell, CellRecord& record);
  void findChildren(const Cell& cell);
  void passSegments(const Cell& cell, std::uint32_t id, CellRecord& record);

  Grid grid_;
  Chunks& chunks_;
  LandmarkSurvey survey_;
  std::vector<GridPoint> snapped_;      // of the current cell
  std::vector<std::uint8_t> is_child_;  // of the current cell: 1: child of a segment; 2: parent of one in a forest
};

}  // namespace filiform::internal
