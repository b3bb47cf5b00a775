// Reads one neuron of a MouseLight JSON file: an object with the lists `axon` and `dendrite`.
//
//   {"idString": "AA0001", "soma": {"x": 1, "y": 2, "z": 3},
//    "axon": [{"sampleNumber": 1, "structureIdentifier": 1, "x": 1, "y": 2, "z": 3, "radius": 1, "parentNumber": -1}],
//    "dendrite": []}
//
// Both lists begin with the soma and number their samples from 1. The soma of the second list is the sample of the
// first one if both have the same place; other ids of the second list get the largest id of the first one added. A
// neuron without samples has the one sample of `soma`. Positions are in um. A type that is missing is that of the list.
// Lines of records are text lines within the neuron. Text that is not JSON: E_FORMAT.
#pragma once

namespace filiform {

namespace internal {
class ByteStream;
class GraphBuilder;
}  // namespace internal

// Reads the whole input into `graph`. graph_file.h states the errors.
void readMouseLight(internal::ByteStream& in, internal::GraphBuilder& graph);

}  // namespace filiform
