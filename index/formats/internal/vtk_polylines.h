// Reads VTK legacy files with polylines: `DATASET POLYDATA`, ASCII or BINARY, versions 1 to 5.1.
//
// POINTS are nodes, numbered from 0. LINES link consecutive points. Radii come from the point data array named radius,
// radii or MaximumInscribedSphereRadius, in any letter case, with one number a point. Vertices, polygons and strips are
// dropped (W_ELEMENT); other data are ignored. A truncated file, another kind of data set or inconsistent counts:
// E_FORMAT.
#pragma once

namespace filiform {

namespace internal {
class ByteStream;
class GraphBuilder;
}  // namespace internal

// Reads the whole input into `graph`. graph_file.h states the errors.
void readVtkPolylines(internal::ByteStream& in, internal::GraphBuilder& graph);

}  // namespace filiform
