// patches.bin: segments that were added to tiles of an older revision. FORMAT.md specifies the bytes. Decoders throw
// Damage and never read past their input.
#pragma once

#include "index/file/internal/set_files.h"
#include "index/set/tile_store.h"

#include <vector>

namespace filiform::internal {

inline constexpr const char* kPatchesFile = "patches.bin";

// A patch is a tile of the segments that were added to another tile's block. All its cells have higher ids than those
// of the other tile.
struct Patch {
  TileId tile;                  // to which the segments were added
  std::uint32_t stored, owned;  // segments of that tile without the patch
  std::uint64_t decoded_bytes;  // of that tile without the patch
  TileLocation at;
};
Bytes encodePatches(const std::vector<Patch>& patches);  // requires ascending tiles
std::vector<Patch> decodePatches(ByteSpan bytes);

}  // namespace filiform::internal
