// Edge lists: the plainest text that holds a graph, and the one in which a cell with loops is exported.
//
//   # anything
//   node ID X Y Z [RADIUS [TYPE]]
//   edge ID ID
//
// One a line, in any order; blanks or tabs between; ids are integers from 0 to 2^63-1 and need not be in sequence; an
// unknown radius is nan or left out. Two nodes may be linked more than once, and loops are kept.
#pragma once

#include <iosfwd>

namespace filiform {

namespace internal {
class ByteStream;
class GraphBuilder;
}  // namespace internal
struct CellGraph;

// Any other first word: W_BAD_LINE. See graph_file.h for what is thrown.
void readEdgeList(internal::ByteStream& in, internal::GraphBuilder& graph);

// Original ids, nodes and then links in file order; positions with the fewest decimals that read back as the same grid
// point. Ids of restarted blocks as in writeSwc. Requires radii and types. The stream's state tells of write errors.
void writeEdgeList(std::ostream& out, const CellGraph& cell);

}  // namespace filiform
