// Synthetic circuits: a column as a SONATA circuit in a folder, for tests and first steps. The same options give the
// same bytes on every machine, as synthetic.h states.
//
//   circuit_config.json
//   column/nodes.h5           the population `column`: positions, quaternions about the vertical axis, attributes; its
//                             texts are entries of a @library
//   input/nodes.h5            the population `input`: virtual nodes, without morphologies
//   morphologies/merged-morphologies.h5    at most SyntheticOptions::library morphologies, format H5 v1
#pragma once

#include "tools/synthetic/synthetic.h"

#include <string>

namespace filiform::tools {

// Fills the folder, which must be empty or absent. `placements_out` and `kind` have no effect: the circuit is a column.
// Nothing is left if it fails. Throws InputError for a folder that is not empty, UsageError for no cells, IoError if
// filiform-hdf5 cannot be started or a file cannot be written, and what `progress` throws. O(cells + segments of the
// library).
SyntheticSummary writeSyntheticCircuit(const SyntheticOptions& options, const std::string& folder,
                                       const SyntheticProgress& progress = {});

}  // namespace filiform::tools
