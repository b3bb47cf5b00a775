// Wavefront OBJ: `v` and `l` lines, as modelling programs write curves and wireframes.
//
// `v x y z` is a node, numbered from 1 as it comes; what follows z is left alone. `l i j k ...` links i to j to k;
// negative numbers count back from the last node, `i/t` is i, a `\` at the end of a line goes on with the next. An end
// that is no number cuts the links on both its sides. Faces, points, curves and surfaces are left out (W_ELEMENT);
// normals, names and materials say nothing about the graph. There are no radii.
#pragma once

namespace filiform {

namespace internal {
class ByteStream;
class GraphBuilder;
}  // namespace internal

// See graph_file.h for what is thrown.
void readObjLines(internal::ByteStream& in, internal::GraphBuilder& graph);

}  // namespace filiform
