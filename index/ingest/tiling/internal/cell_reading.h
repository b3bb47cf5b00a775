// readCells: takes the cells of a stream apart on several threads.
#pragma once

#include "index/ingest/tiling/internal/cell_intake.h"

#include <cstdint>
#include <functional>

namespace filiform::internal {

struct CellReading {
  Grid grid;
  std::uint64_t most_in_chunk = 0;
  std::size_t most_open = 0;  // blocks of segments that may have a buffer
  unsigned threads = 1;
  // The calling thread calls them; an exception ends the work. `progress` before each cell; `check` every 256 cells,
  // while the intake does not change. `blocks`: number of blocks that hold segments.
  std::function<void(std::uint64_t segments)> progress;
  std::function<void(std::size_t blocks)> check;
};

// Adds the cells to `intake`, their segments to `chunks`, and their lengths to `survey`. The calling thread reads the
// stream. It takes large cells apart itself, so that only one is in memory at a time. Throws InputError if there are
// too many cells, and what CellWork and the stream throw. Thread rule: any thread; starts its own threads.
void readCells(CellStream& stream, const CellReading& reading, Spool& spool, CellIntake& intake, Chunks& chunks,
               LandmarkSurvey& survey);

}  // namespace filiform::internal
