// Reads Wavefront OBJ: `v` and `l` lines, as modelling programs write curves and wireframes.
//
// `v x y z` is a node; nodes are numbered from 1, and fields after z are ignored. `l i j k ...` links i to j and j to
// k. A negative number counts back from the last node. `i/t` means i. A `\` at the end of a line continues the line. A
// field that is not a number cuts the links on both sides. Faces, points, curves and surfaces are dropped (W_ELEMENT).
// Normals, names and materials are ignored. The format has no radii.
#pragma once

namespace filiform {

namespace internal {
class ByteStream;
class GraphBuilder;
}  // namespace internal

// Reads the whole input into `graph`. graph_file.h states the errors.
void readObjLines(internal::ByteStream& in, internal::GraphBuilder& graph);

}  // namespace filiform
