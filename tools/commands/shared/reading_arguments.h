// The options of commands that read neurons: which of them, and how. Thread rule: values.
#pragma once

#include "index/circuits/circuit.h"
#include "index/input/input.h"
#include "tools/commands/shared/remote_arguments.h"

#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace filiform::tools {

inline constexpr const char* kInputHelp =
    "SWC, ASC, H5, NML, CATMAID CSV, MouseLight JSON; folders; archives (zip, tar, tar.gz); Neuroglancer skeletons, or "
    "a "
    "volume that has them, in a folder or at an address (http, https, s3, gs; for gs, STORAGE_EMULATOR_HOST names "
    "another server); "
    "graphs: .edges, .obj, .vtk; or one SONATA circuit_config.json or nodes.h5";

struct ReadingArguments {
  std::string version = "cng", ids;
  std::vector<std::string> where, box;
  std::shared_ptr<RemoteArguments> remote;

  // Sets the options that these arguments name. Throws IoError and InputError for the file of
  // --ids, UsageError for a number of --box.
  void apply(InputOptions& options) const;
};

// Adds --version, --ids, --where, --box, and the options for addresses. `with_sets`: the command reads tile sets too.
std::shared_ptr<ReadingArguments> addReadingArguments(CLI::App& command, bool with_sets = false);
// Adds --population, --morphologies and --no-soma-links.
void addCircuitArguments(CLI::App& command, CircuitOptions& circuit, bool& no_soma_links);

}  // namespace filiform::tools
