// TilePlace: where the bytes of a tile lie, for errors. Thread rule: a value.
#pragma once

#include "index/geometry/morton.h"
#include "index/tile/tile.h"

#include <cstdint>

namespace filiform {

// Which tile the bytes are of, and where they lie. Errors name `file` and the position of the fault in it.
struct TilePlace {
  TileId tile;
  BlockKey key;
  bool is_long;          // the long-segment tile
  const char* file;      // its name; must live during the call
  std::uint64_t offset;  // position of the first byte in the file
};

}  // namespace filiform
