// Edge lists: the plainest text that holds a graph. A cell with loops is exported in it, see writeEdgeList().
//
//   # anything
//   node ID X Y Z [RADIUS [TYPE]]
//   edge ID ID
//
// One a line, in any order; blanks or tabs between; ids are integers from 0 to 2^63-1 and need not be in sequence; an
// unknown radius is nan or left out. Two nodes may be linked more than once, and loops are kept.
#pragma once

namespace filiform {

namespace internal {
class ByteStream;
class GraphBuilder;
}  // namespace internal

// Any other first word: W_BAD_LINE. See graph_file.h for what is thrown.
void readEdgeList(internal::ByteStream& in, internal::GraphBuilder& graph);

}  // namespace filiform
