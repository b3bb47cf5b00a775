// VTK legacy files with polylines: `DATASET POLYDATA`, ASCII or BINARY, versions 1 to 5.1.
//
// POINTS are nodes, numbered from 0; LINES link consecutive points; the point data array named radius, radii or
// MaximumInscribedSphereRadius, in any letter case, one number a point, is the radius. Vertices, polygons and strips
// are left out (W_ELEMENT); other data say nothing about the graph. A file that ends too soon, another kind of data
// set, or counts that do not add up: E_FORMAT.
#pragma once

namespace filiform {

namespace internal {
class ByteStream;
class GraphBuilder;
}  // namespace internal

// See graph_file.h for what is thrown.
void readVtkPolylines(internal::ByteStream& in, internal::GraphBuilder& graph);

}  // namespace filiform
