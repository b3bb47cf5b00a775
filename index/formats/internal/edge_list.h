// Reads edge lists: the plainest text format that holds a graph. writeEdgeList() exports cells with loops in it.
//
//   # anything
//   node ID X Y Z [RADIUS [TYPE]]
//   edge ID ID
//
// One node or edge a line, in any order, with blanks or tabs between fields. Ids are integers from 0 to 2^63-1, in any
// sequence. An unknown radius is nan or left out. Two nodes may be linked more than once; loops are kept.
#pragma once

namespace filiform {

namespace internal {
class ByteStream;
class GraphBuilder;
}  // namespace internal

// Reads the whole input into `graph`. A line with another first word is W_BAD_LINE. graph_file.h states the errors.
void readEdgeList(internal::ByteStream& in, internal::GraphBuilder& graph);

}  // namespace filiform
