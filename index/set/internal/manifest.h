// manifest.json and provenance.json: what a revision holds, and from which inputs it was made. FORMAT.md specifies
// both.
#pragma once

#include "index/file/internal/bytes.h"
#include "index/file/internal/set_files.h"
#include "index/set/provenance.h"
#include "index/set/set_counts.h"
#include "index/set/tile_store.h"

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

struct Manifest {
  std::uint32_t version = kFormatVersion;
  Grid grid;
  std::uint32_t capacity = 0;
  GridBox bounds;
  std::optional<UsualBox> usual = {};  // TileStore::usualBox()
  SetCounts counts;
  double covering_radius_um = 0;
  std::uint64_t refused = 0;      // number of refused inputs
  std::uint64_t skipped = 0;      // number of skipped inputs
  bool grown = false;             // TileSet::grown()
  std::uint64_t floor_bytes = 0;  // TileStore::floorBytes()
  Bytes directory_root;
  std::uint64_t cells_root_bytes = 0, cells_root_checksum = 0;  // the root is the end of cells.bin
  std::vector<SetFile> files;
};
// The manifest holds only the numbers of the provenance. writeProvenance() writes the rest: a line for each source and
// refused input.
std::string encodeManifest(const Manifest& manifest, const Provenance& provenance);
void writeProvenance(const Provenance& provenance, const std::function<void(std::string_view piece)>& use);
Manifest decodeManifest(const std::string& text);
// The provenance of a set: from its file, and the codes from its manifest.
Provenance decodeProvenance(const std::string& text, const std::string& manifest);

std::string revisionName(const std::string& manifest);
bool isRevisionName(const std::string& name);

}  // namespace filiform::internal
