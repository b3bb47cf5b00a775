// The scene of a command: a tile set, or a small .swc or .zip file. Thread rule: functions without state.
#pragma once

#include "index/set/tile_store.h"

#include <memory>
#include <string>

namespace filiform::tools {

// Returns whether the name ends in .swc or .zip, in any letter case. The tiles of such a file are built in memory.
bool isFileScene(const std::string& path);
// Reads the whole file and builds its tiles in memory. Throws InputError if the file has no usable neuron, IoError.
std::unique_ptr<TileStore> buildScene(const std::string& path);

}  // namespace filiform::tools
