// Reads the skeletons of a table that CATMAID exports as CSV.
//
//   skeleton_id, treenode_id, parent_treenode_id, x, y, z, r
//   16, 1, null, 10, 20, 30, 2000
//   16, 2, 1, 20, 20, 30, -1
//
// The first line names the columns, in any order; `parent_id` and `radius` are known too, and other columns are left
// out. Columns are separated by commas, semicolons or tabs; blanks and quotes around a value are ignored. A root has no
// parent: nothing, `null`, `none`, `nan` or -1. Positions and radii are in nm, as CATMAID's; a unit of the options
// other than um replaces nm. Types are 0. Thread rule: pure functions, any thread.
#pragma once

namespace filiform {

namespace internal {
class ByteStream;
class GraphBuilder;

}  // namespace internal

// Reads the lines of one skeleton, after the line of the columns. A line `#line N` says that line N of the file
// follows. graph_file.h states the errors.
void readCatmaid(internal::ByteStream& in, internal::GraphBuilder& graph);

}  // namespace filiform
