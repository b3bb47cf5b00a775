// A revision that differs from an older one in a few files, none of them tiles.
#pragma once

#include "index/file/internal/bytes.h"
#include "index/set/internal/set_folder.h"
#include "index/set/provenance.h"
#include "index/set/tile_set.h"

#include <map>
#include <string>

namespace filiform::internal {

// Publishes a revision of `folder` that has the files of `base`, its current revision, by reference. `sections`: those
// that it has instead, by name; without bytes it has none. `provenance`: its inputs; null: those of `base`. Returns its
// name; that of `base`, and publishes nothing, if nothing differs. Throws IoError, CorruptSet. O(bytes written).
std::string publishAmended(SetFolder& folder, const TileSet& base, const std::map<std::string, Bytes>& sections,
                           const Provenance* provenance = nullptr);

}  // namespace filiform::internal
