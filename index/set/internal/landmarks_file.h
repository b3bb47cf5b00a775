// samples.bin: the landmarks. FORMAT.md specifies the bytes.
#pragma once

#include "index/file/internal/set_files.h"
#include "index/set/tile_store.h"

namespace filiform::internal {

Bytes encodeLandmarks(const Landmarks& landmarks);
Landmarks decodeLandmarks(ByteSpan bytes);

}  // namespace filiform::internal
