#include "tools/commands/shared/scene.h"

#include "index/errors.h"
#include "index/ingest/memory_tiles.h"
#include "index/input/input.h"
#include "index/text.h"

namespace filiform::tools {

bool isFileScene(const std::string& path) { return endsWithNoCase(path, ".swc") || endsWithNoCase(path, ".zip"); }

std::unique_ptr<TileStore> buildScene(const std::string& path) {
  Input input({path});
  auto store = buildTilesInMemory(input);
  if (store->cell_count() == 0)
    throw InputError(inShort(path) + ": no usable neuron in this file; filiform check lists what is wrong");
  return store;
}

}  // namespace filiform::tools
