// Writes cells in formats of other programs: edge list, Wavefront OBJ, VTK legacy polylines. Neuroglancer skeletons are
// in skeleton_format.h. writeSwc() (cell_graph.h) and writeEdgeList() lose nothing.
//
// Input reads all of these formats back with the same grid points and links. OBJ and VTK number the nodes anew.
// Functions require radii and types unless stated otherwise. Write errors set the stream's state. O(samples). Thread
// rule: functions without state.
#pragma once

#include "index/query/cell_graph.h"

#include <iosfwd>

namespace filiform {

// Edge list (edge_list.h): original ids, nodes first, then links in file order. A coordinate has the fewest decimals
// that read back as the same grid point. Ids of restarted blocks change as in writeSwc().
void writeEdgeList(std::ostream& out, const CellGraph& cell);

// `v` lines in um and one `l` line a link. Writes neither radii nor types, and does not require them.
void writeObj(std::ostream& out, const CellGraph& cell);

// ASCII, version 3.0: points in um, one line a link, and the point arrays `radius` and `type`. Radii are in um, nan
// where unknown; the array is left out if no radius is known.
void writeVtk(std::ostream& out, const CellGraph& cell);

}  // namespace filiform
