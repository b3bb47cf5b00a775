// Cells in the formats of other programs: Wavefront OBJ, VTK legacy polylines, Neuroglancer precomputed skeletons.
// writeSwc (cell_graph.h) and writeEdgeList write the formats that hold everything. Input reads all of them back: the
// same grid points and links; other formats give the node ids 1, 2, 3 ... Requires radii and types, unless stated.
// The stream's state tells of write errors. Thread rule: functions without state. O(samples).
#pragma once

#include "index/cell_graph.h"

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace filiform {

// Edge list, see edge_list.h: original ids, nodes and then links in file order. A coordinate has the fewest decimals
// that read back as the same grid point. Ids of restarted blocks are as in writeSwc.
void writeEdgeList(std::ostream& out, const CellGraph& cell);

// `v` lines in um and one `l` line a link. Holds neither radii nor types, and asks for none.
void writeObj(std::ostream& out, const CellGraph& cell);

// ASCII, version 3.0: points in um, one line a link, the point arrays `radius` (um, nan where unknown; left out where
// none is known) and `type`.
void writeVtk(std::ostream& out, const CellGraph& cell);

// A folder of unsharded Neuroglancer skeletons: `info`, and one file a cell, named by a number. Vertices are whole
// quanta from `origin`, as 32-bit floats, and `transform` in the info gives their nm: exact.
class SkeletonFormat {
 public:
  // Requires bounds that hold every cell. Throws InputError where these are wider than 2^25 quanta (65 mm at the
  // default quantum): 32-bit floats would not hold all of their grid points.
  SkeletonFormat(const Grid& grid, const GridBox& bounds);

  std::string info() const;
  // Labels of the cells, for `segment_properties/info`. Requires as many names as ids.
  static std::string properties(const std::vector<std::uint64_t>& ids, const std::vector<std::string>& names);
  // Radii in nm as 32-bit floats: those read back differ by 1e-7 of themselves where no such float gives the same um.
  void write(std::ostream& out, const CellGraph& cell) const;

 private:
  Grid grid_;
  GridPoint origin_;
};

}  // namespace filiform
