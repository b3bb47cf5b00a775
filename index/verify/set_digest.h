// setDigest: one digest over all bytes of a revision, which names a set from strangers.
#pragma once

#include "index/set/tile_set.h"

#include <cstdint>
#include <functional>
#include <string>

namespace filiform {

// The SHA-256 of manifest.json followed by the files that it lists, in its order: 64 hexadecimal digits, lower case.
// Reads every byte and compares the digests of the manifest. step(done): before each file, bytes so far; what it throws
// propagates. Throws CorruptSet, IoError. O(bytes). Thread rule: pure function, any thread.
std::string setDigest(const TileSet& set, const std::function<void(std::uint64_t done)>& step);

}  // namespace filiform
