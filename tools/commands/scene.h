// A scene that a command is given: a tile set, or a small file that needs none.
#pragma once

#include "index/set/tile_store.h"

#include <memory>
#include <string>

namespace filiform::tools {

// By its name an .swc or .zip file, whose tiles are built in memory.
bool isFileScene(const std::string& path);
// Reads such a file whole: no files, IO threads or search trees then. Throws InputError where no usable neuron is in
// it, IoError.
std::unique_ptr<TileStore> buildScene(const std::string& path);

}  // namespace filiform::tools
