// RankSteps: the steps of a tiler that all ranks take together. Each rank reads some cells. It then gets the segments
// of a range of Morton keys, and makes the tiles of this range.
#pragma once

#include "index/ingest/ranks/internal/rank_streams.h"
#include "index/ingest/tiling/internal/cell_intake.h"
#include "index/ingest/tiling/internal/chunks.h"
#include "index/ingest/tiling/landmarks.h"

#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

namespace filiform::internal {

// Thread rule: as Ranks. Every member throws what Ranks throws, and IoError.
class RankSteps {
 public:
  // Keeps references.
  RankSteps(Ranks& ranks, Spool& spool) : ranks_(ranks), spool_(spool) {}

  bool isFirst() const { return ranks_.rank() == 0; }
  bool isLast() const { return ranks_.rank() + 1 == ranks_.count(); }

  // After reading: what all ranks have read.
  struct Totals {
    std::uint32_t first_cell = 0;  // id of the first cell that this rank has read
    std::uint64_t segments = 0;
    GridBox bounds;
  };
  Totals total(const CellIntake& intake);
  // Passes all cells to rank 0.
  void gatherCells(CellIntake& intake);
  // Chooses the range of each rank, and moves all segments to `own`, which is confined to the range of this rank.
  // Calls `progress` now and then with the number of segments moved; its exceptions propagate.
  void distribute(Chunks& read, Chunks& own, std::uint32_t first_cell, std::uint32_t capacity,
                  const std::function<void(std::uint64_t moved)>& progress);
  // Shares the leaves, with the number of midpoints in each. Returns those of all ranks.
  std::vector<BlockKey> shareLeaves(const std::vector<BlockKey>& leaves, std::vector<std::uint32_t>& midpoints);
  // After shareLeaves(): inserts a chunk for the leaves of each other rank. Returns the positions of the own chunks.
  std::pair<std::size_t, std::size_t> addOtherChunks(std::vector<Chunk>& chunks);
  // The survey of all ranks.
  LandmarkSurvey shareSurvey(const LandmarkSurvey& survey);
  // Passes the ghosts of other ranks' chunks to those ranks. Appends what arrives to `arrived`.
  void exchangeGhosts(std::vector<Chunk>& chunks, SegmentChain& arrived);
  // Passes all of them to the last rank.
  void gatherLong(std::vector<SegmentChain>& long_segments);
  // Passes pairs of cell and leaf, and the parts of the landmarks, to rank 0, which calls `use` for each pair.
  void gatherFound(std::vector<ByteChain>& pairs, std::vector<LandmarkChooser::Part>& parts,
                   const std::function<void(std::uint32_t cell, std::uint32_t leaf)>& use);
  // The first leaf of this rank.
  std::uint32_t first_leaf() const { return first_leaf_[ranks_.rank()]; }

 private:
  Ranks& ranks_;
  Spool& spool_;
  std::vector<std::uint32_t> first_leaf_;  // by rank, and the end
};

}  // namespace filiform::internal
