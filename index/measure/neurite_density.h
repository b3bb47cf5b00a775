// The length of neurites in each box of a grid. MEASURES.md defines which segments count.
//
//   const NeuriteDensity density = densityOf(*set, {.step_um = 50});
//   for (double length_um : density.lengths_um) std::cout << length_um / density.box_um3() << '\n';  // um per um3
#pragma once

#include "index/set/tile_store.h"

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace filiform {

struct DensityOptions {
  double step_um = 0;                                 // edge of the boxes, above 0
  std::optional<std::vector<std::uint32_t>> cells{};  // only segments of these, each below cell_count(); nullopt: all
  std::vector<std::uint16_t> types{};                 // only segments of these types; empty: all
  bool by_cell = false, by_type = false;              // also the length of each cell, of each type, by box
  std::uint64_t most_boxes = std::uint64_t{1} << 25;  // of the grid, 8 bytes each; of the groups, 24 bytes each
  unsigned threads = 1;                               // that decode tiles
  std::function<void()> check{};                      // called before each tile; its exceptions propagate
};

// The length of one group in one box. Thread rule: a value.
struct DensityGroup {
  std::uint64_t box = 0;   // position in NeuriteDensity::lengths_um
  std::uint32_t cell = 0;  // 0 unless by_cell
  std::uint16_t type = 0;  // 0 unless by_type
  double length_um = 0;    // above 0
};

// A grid whose planes lie at multiples of the step, about the boxes of the cells. Thread rule: a value.
struct NeuriteDensity {
  double step_um = 0;
  std::array<std::int64_t, 3> first{};  // the lowest corner, in steps
  std::array<std::size_t, 3> boxes{};   // along x, y, z; 0 without cells
  std::vector<double> lengths_um;       // by box: z changes fastest, then y
  std::vector<DensityGroup> groups{};   // with by_cell or by_type: ascending by box, cell, type

  Vector3d corner_um(std::size_t x, std::size_t y, std::size_t z) const {
    return step_um * Vector3d(static_cast<double>(first[0] + static_cast<std::int64_t>(x)),
                              static_cast<double>(first[1] + static_cast<std::int64_t>(y)),
                              static_cast<double>(first[2] + static_cast<std::int64_t>(z)));
  }
  Vector3d cornerOf(std::size_t box) const {  // of a position in lengths_um
    return corner_um(box / boxes[2] / boxes[1], box / boxes[2] % boxes[1], box % boxes[2]);
  }
  double box_um3() const { return step_um * step_um * step_um; }
};

// Cuts each segment at the planes of the grid; a piece on a plane counts to the upper box. So the lengths add up to
// that of the segments, up to rounding. Reads each tile once, in their order, and before that the tiles that hold
// segments of somata. The same bits for any number of threads. Throws UsageError for a step that is not above 0, and
// for a grid of more than most_boxes, with their number, or more groups; what the store throws. Thread rule: any thread
// but the haptic one. Memory: 8 bytes a box, with groups up to 60 bytes for each of most_boxes while
// they are merged, and what forEachSegment() takes. O(segments + planes that they cross + boxes), and with groups a
// sort of them.
NeuriteDensity densityOf(const TileStore& store, const DensityOptions& options);

}  // namespace filiform
