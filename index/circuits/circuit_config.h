// Reads a SONATA circuit_config.json: which populations of nodes a circuit has, and where their morphologies lie. Both
// forms in use are read: that of the Allen Institute and that of the Blue Brain Project and its successors.
//
// Thread rule: values and pure functions.
#pragma once

#include "index/errors.h"

#include <optional>
#include <string>
#include <vector>

namespace filiform {

// Where the morphologies of a population lie. Empty paths are absent.
struct MorphologyPlaces {
  std::string swc_folder, h5, asc_folder;  // h5: a folder of files, or a container
  bool empty() const { return swc_folder.empty() && h5.empty() && asc_folder.empty(); }
};

struct CircuitPopulation {
  std::string nodes_file, node_types_file;  // node_types_file: empty if there is none
  std::string name;                         // empty: all populations of the file
  std::string type;                         // "biophysical", "virtual", "vasculature" ...; empty if it is not stated
  MorphologyPlaces morphologies;
};

struct CircuitConfig {
  std::string path;                            // of the file
  std::string folder;                          // in which it lies: paths are relative to it
  std::vector<CircuitPopulation> populations;  // in the order of the file
};

// Variables of the `manifest` may refer to each other; ${configdir} is the folder of the file. Throws IoError if the
// file cannot be read. Throws InputError naming file and key for: no JSON object, no `networks`, a value of the wrong
// type, an unknown variable, variables that refer to each other in a circle. O(bytes).
CircuitConfig readCircuitConfig(const std::string& path);

// True if the file seems to be a circuit_config.json: its name ends in .json, and its first bytes mention `networks` or
// `manifest`. False if it cannot be read. O(1).
bool isCircuitConfig(const std::string& path);

}  // namespace filiform
