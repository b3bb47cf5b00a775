// Sets that a faulty or hostile writer would write: all checksums match, the content does not.
#pragma once

#include "index/set/tile_store.h"
#include "index/tile/tile.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform::test {

// Errors of a faulty or hostile writer, made before writing, so that all checksums match.
struct Faults {
  std::function<void(TileId, std::vector<StoredSegment>&)> segments;
  std::function<void(TileId, TileEntry&)> entry;
  std::function<void(std::uint32_t, CellDetail&)> detail;
  std::function<void(std::vector<CellRecord>&)> records;
  std::function<void(Landmarks&)> landmarks;
};

// Writes the tiles of a store as a set, with faults.
void writeFaultySet(const TileStore& store, const std::string& path, const Faults& faults);
// Changes the manifest of a set in a folder, and the name of its revision with it.
void changeManifest(const std::string& path, const std::function<void(nlohmann::ordered_json& manifest)>& change);

// A set whose first cell states this number of samples and segments, in its record and by one run of ids. The manifest
// counts them only if `counted`.
void writeBoastfulSet(const TileStore& store, const std::string& path, std::uint32_t samples, bool counted);

}  // namespace filiform::test
