// Synthetic neurons: a cortical column of any size, or a named test scene, as SWC files in a zip archive or as cells in
// memory. The same options give the same bytes on every machine (arithmetic and square roots only; fixed dates in the
// archive).
//
// The recipe of a column (300 um wide, white matter at y = 0, pia at y = 1400 um, layers L1 to L6):
//  1. A cell's layer follows its number, in the proportions of cortex; within a layer 8 to 18 % are interneurons (all
//  in L1).
//  2. Somata lie at random in a disc of 150 um radius and in the depth of their layer; three samples stand for each.
//  3. Stems leave the soma as far from each other as candidates allow, so that dendrites balance; they wander outwards,
//  branch
//     near the soma and end in long unbranched twigs; daughters share the parent's radius by Rall's 3/2 rule.
//  4. Pyramidal cells send an apical trunk to L1, with obliques and a tuft (L6: a small tuft in L4; star pyramids:
//  none).
//  5. Their axons go straight down into the white matter and give off collaterals, some recurrent, until the cell has
//  the size
//     drawn for its type: 1800 to 11 000 segments, median about 4000.
//  6. Basket and neurogliaform axons fill a ball around the soma, Martinotti axons rise to L1, stellate axons stay
//  local.
//  7. Steps are 1 to 6 um long, 2.4 um on average; coordinates and radii have three decimals.
#pragma once

#include "index/cell/cell.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace filiform::tools {

struct SyntheticOptions {
  // "column", "traces", "fan", or a scene (sceneKinds()). A scene is one cell; `cells` and `seed` do not apply to it.
  // "traces" makes `cells` neurons, on a voxel lattice and with a jittered depth in turn (synthetic_trace.h). "fan"
  // makes `cells` fans of 3, 5, 7 and 10 branches in turn (synthetic_fan.h). `placements_out` applies to a column only.
  std::string kind = "column";
  std::uint32_t cells = 200;
  std::uint64_t seed = 1;
  // Not empty: the archive holds a library of at most `library` morphologies with their somata on the column's axis,
  // and this file becomes the table that places them `cells` times, within 257 um of the axis: 31 000 cells are then a
  // column of 0.29 mm^3 and 2e8 segments. A library's cells are 45 % larger than a column's, about 6400 segments.
  std::string placements_out;
  std::uint32_t library = 50;
};

struct SyntheticSummary {
  std::uint64_t cells = 0;  // placed ones; files in the archive if there is no table
  std::uint64_t files = 0;
  std::uint64_t samples = 0;     // in the files
  std::uint64_t segments = 0;    // in the files
  std::uint64_t text_bytes = 0;  // of SWC
  std::uint64_t zip_bytes = 0;
};

// Called after each file with the number done and the total. May throw to stop; nothing is then left behind.
using SyntheticProgress = std::function<void(std::uint64_t done, std::uint64_t total)>;

// Writes the archive (and the table), replacing files of that name only when everything is written. Memory does not
// grow with the cells' sizes: one file at a time is held. `cancel` ends the wait for a pipe's reader. Throws UsageError
// on an unknown kind or no cells, and as Output does (index/output.h). O(segments).
SyntheticSummary writeSynthetic(const SyntheticOptions& options, const std::string& out_zip,
                                const SyntheticProgress& progress = {}, const std::atomic<bool>* cancel = nullptr);

// The kinds that writeSynthetic knows.
const std::vector<std::string>& syntheticKinds();
// Of these, the scenes:
//   scene1   one path without branches, with sharp concave elbows (the paper's Figure 2)
//   scene2   a branching structure, the way with simple forks
//   scene3   the same structure, the way with nodes from which several branches leave nearly parallel (its Figure 3)
//   elbows   scene 1 with rounded corners
//   hooks    wide forks, rounded corners, a way with two hooks
const std::vector<std::string>& sceneKinds();
// The kinds as a message lists them: "column, fan, ... or hooks".
std::string kindList(const std::vector<std::string>& kinds);

// The route meant for a scene, as `ROOT:TIP` of sample ids; also in the header of its file. Throws UsageError for other
// kinds.
std::string sceneRoute(const std::string& kind);

// The same neurons without an archive: what a reader would make of it, digests included. Thread-compatible.
class SyntheticCells : public CellStream {
 public:
  // `archive` is put before each source, as in "column.zip/column/L4/cell_00042.swc"; empty: the entry's path alone.
  // `placements_out` is ignored. Throws UsageError as writeSynthetic.
  explicit SyntheticCells(const SyntheticOptions& options, std::string archive = "");
  ~SyntheticCells() override;

  bool next(Cell& cell) override;
  std::uint64_t cells() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::tools
