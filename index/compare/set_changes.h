// Compares two tile sets cell by cell: what was added, removed, moved and changed. Cells are the same if their names
// are.
//
//   const auto before = TileSet::open("old.fil"), now = TileSet::open("new.fil");
//   compareSets(*before, *now, {}, [](const CellDifference& cell) {
//     if (cell.change.kind != CellFate::kSame) std::cout << cell.names[0] << ' ' << name(cell.change.kind) << '\n';
//   });
//
// Thread rule: any thread but the haptic one; functions run on the calling thread.
#pragma once

#include "index/compare/cell_change.h"
#include "index/compare/trace_distance.h"
#include "index/set/tile_store.h"

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace filiform {

struct SetChangesOptions {
  // Measures the distances of changed cells, both ways; 0: no distances. As TraceDistanceOptions::within_um.
  double within_um = 0;
  std::uint64_t memory_bytes = 512 << 20;  // for cells that are put together, half for each set
  unsigned threads = 1;                    // that decode tiles, at least 1
  // Called now and then with the number of cells compared; its exceptions propagate.
  std::function<void(std::uint64_t done)> check{};
};

// A cell in two versions, or two traces of one neuron. What is in pairs is of the first, then of the second.
struct CellDifference {
  std::array<std::string, 2> names{};  // empty where the cell is not
  CellChange change;
  std::array<std::uint64_t, 2> samples{};
  std::array<double, 2> length_um{};  // lengthOf_um()
  // The first from the second, and the second from the first. nullopt: not measured.
  std::optional<std::array<TraceDistance, 2>> distance{};
};

// Compares two cells. `measuring`: measures their distances too, if both have a sample; nullptr: no distances. Requires
// radii and types. O(n log n), and the distances.
CellDifference differenceOf(const CellGraph& a, const CellGraph& b, const TraceDistanceOptions* measuring);

// The number of cells that compareSets() visits. O(cells).
std::uint64_t cellsOfBoth(const TileStore& a, const TileStore& b);

// Calls `visit` for each cell of the sets: first those of `a`, by id, then those that only `b` has, by id. Throws what
// the stores throw; exceptions of `visit` propagate. Memory: `memory_bytes`, two cells, and what a pass over cells
// needs beside (index/query/cell_pass.h). O(segments of both sets), if one pass over each suffices, and the distances.
void compareSets(const TileStore& a, const TileStore& b, const SetChangesOptions& options,
                 const std::function<void(const CellDifference& cell)>& visit);

}  // namespace filiform
