// Writes cells in formats of other programs: edge list, Wavefront OBJ, VTK legacy polylines, Neuroglancer skeletons.
// writeSwc() (cell_graph.h) and writeEdgeList() lose nothing.
//
// Input reads all of these formats back with the same grid points and links. OBJ, VTK and skeletons number the nodes
// anew. Functions require radii and types unless stated otherwise. Write errors set the stream's state. O(samples).
// Thread rule: functions without state.
#pragma once

#include "index/set/cell_graph.h"

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace filiform {

// Edge list (edge_list.h): original ids, nodes first, then links in file order. A coordinate has the fewest decimals
// that read back as the same grid point. Ids of restarted blocks change as in writeSwc().
void writeEdgeList(std::ostream& out, const CellGraph& cell);

// `v` lines in um and one `l` line a link. Writes neither radii nor types, and does not require them.
void writeObj(std::ostream& out, const CellGraph& cell);

// ASCII, version 3.0: points in um, one line a link, and the point arrays `radius` and `type`. Radii are in um, nan
// where unknown; the array is left out if no radius is known.
void writeVtk(std::ostream& out, const CellGraph& cell);

// A folder of unsharded Neuroglancer skeletons: `info`, and one file a cell, named by a number. Vertices are whole
// quanta from the centre of the bounds, as 32-bit floats. `transform` in the info converts them to nm, exactly.
class SkeletonFormat {
 public:
  // Requires bounds that contain every cell. Throws InputError if the bounds are wider than 2^25 quanta (65 mm at the
  // default quantum), because 32-bit floats cannot hold these grid points.
  SkeletonFormat(const Grid& grid, const GridBox& bounds);

  // Text of the file `info`.
  std::string info() const;
  // Text of `segment_properties/info`: the labels of the cells. Requires as many names as ids.
  static std::string properties(const std::vector<std::uint64_t>& ids, const std::vector<std::string>& names);
  // Writes one skeleton. Radii are 32-bit floats in nm; a radius read back in um may differ by a factor of 1e-7.
  void write(std::ostream& out, const CellGraph& cell) const;

 private:
  Grid grid_;
  GridPoint origin_;
};

}  // namespace filiform
