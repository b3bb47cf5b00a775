// Synthetic neurons: a cortical column of any size, or a named test scene, as SWC files in a zip archive or as cells in
// memory. The same options give the same bytes on every machine: the code uses only arithmetic, square roots and fixed
// dates.
//
// The recipe of a column (300 um wide, white matter at y = 0, pia at y = 1400 um, layers L1 to L6):
//  1. The number of a cell decides its layer, in the proportions of cortex. In each layer 8 to 18 % of the cells are
//     interneurons; in L1 all are.
//  2. Somata lie at random in a disc of 150 um radius, within the depth of their layer. Three samples form a soma.
//  3. Stems leave the soma in balanced directions, wander outwards, branch near the soma and end in long unbranched
//     twigs. Daughters share the parent's radius by Rall's 3/2 rule.
//  4. Pyramidal cells send an apical trunk to L1, with obliques and a tuft. In L6 the tuft is small and lies in L4;
//  star
//     pyramids have no tuft.
//  5. Axons of pyramidal cells go straight down into the white matter and give off collaterals, some of them recurrent,
//     until the cell has the size drawn for its type: 1800 to 11 000 segments, median about 4000.
//  6. Basket and neurogliaform axons fill a ball around the soma, Martinotti axons rise to L1, stellate axons stay
//     local.
//  7. Steps are 1 to 6 um long, 2.4 um on average. Coordinates and radii have three decimals.
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
  // "column", "traces", "fan", or a scene (sceneKinds(), hardSceneKinds()). A scene is one cell, and ignores `cells`
  // and `seed`. "traces" makes `cells` neurons, in turn on a voxel lattice and with a jittered depth
  // (synthetic_trace.h). "fan" makes `cells` fans of 3, 5, 7 and 10 branches in turn (synthetic_fan.h). Only a column
  // uses `placements_out`.
  std::string kind = "column";
  std::uint32_t cells = 200;
  std::uint64_t seed = 1;
  // If not empty, the archive holds a library of at most `library` morphologies with their somata on the column's axis,
  // and this file becomes the table that places them `cells` times within 257 um of the axis. 31 000 cells then form a
  // column of 0.29 mm^3 and 2e8 segments. Library cells are 45 % larger than column cells: about 6400 segments.
  std::string placements_out;
  std::uint32_t library = 50;
};

struct SyntheticSummary {
  std::uint64_t cells = 0;  // placed cells; without a table the files in the archive
  std::uint64_t files = 0;
  std::uint64_t samples = 0;     // in the files
  std::uint64_t segments = 0;    // in the files
  std::uint64_t text_bytes = 0;  // of SWC
  std::uint64_t zip_bytes = 0;
};

// Called after each file with the number done and the total. An exception stops the work; no output is then left.
using SyntheticProgress = std::function<void(std::uint64_t done, std::uint64_t total)>;

// Writes the archive, and the table if asked for. Existing files are replaced after everything is written. Holds one
// file in memory at a time. `cancel` ends the wait for a pipe's reader. Throws UsageError for an unknown kind or no
// cells, and as Output does (index/output.h). O(segments).
SyntheticSummary writeSynthetic(const SyntheticOptions& options, const std::string& out_zip,
                                const SyntheticProgress& progress = {}, const std::atomic<bool>* cancel = nullptr);

// The kinds that writeSynthetic() accepts.
const std::vector<std::string>& syntheticKinds();
// The kinds that are scenes:
//   scene1   one path without branches, with sharp concave elbows (the paper's Figure 2)
//   scene2   a branching structure; the route has simple forks
//   scene3   the same structure; the route has nodes with several nearly parallel branches (the paper's Figure 3)
//   elbows   scene 1 with rounded corners
//   hooks    wide forks and rounded corners; the route has two hooks
const std::vector<std::string>& sceneKinds();
// Kinds that are scenes too, and hard to follow:
//   hub      20 000 branches of 100 um at one node; the route goes from tip to tip
//   bouquet  60 branches within .15 rad of a trunk; the route ends in their middle
//   coil     60 turns of radius 2 um, .5 um apart
//   meander  60 lanes of 6 um, .5 um apart
const std::vector<std::string>& hardSceneKinds();
// The kinds as text for messages: "column, fan, ... or hooks".
std::string kindList(const std::vector<std::string>& kinds);

// The suggested route of a scene, as `ROOT:TIP` of sample ids; also in the header of its file. Throws UsageError for
// other kinds.
std::string sceneRoute(const std::string& kind);

// The same neurons without an archive: as a reader returns them, digests included. Thread-compatible.
class SyntheticCells : public CellStream {
 public:
  // `archive` is put before each source, as in "column.zip/column/L4/cell_00042.swc"; empty: the path of the entry
  // alone. `placements_out` is ignored. Throws UsageError as writeSynthetic() does.
  explicit SyntheticCells(const SyntheticOptions& options, std::string archive = "");
  ~SyntheticCells() override;

  bool next(Cell& cell) override;
  std::uint64_t cells() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::tools
