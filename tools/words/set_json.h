// What `info --json` and the service state about a set. Functions without state.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform {
class Levels;
class TileSet;
}  // namespace filiform

namespace filiform::tools {

// The fields of `info --json`, in its order. `levels`: nullptr if the set has none. tools/README.md lists the fields.
// Throws CorruptSet, IoError. O(levels + refused and skipped inputs).
nlohmann::ordered_json setJson(const TileSet& set, const Levels* levels);

// Names and reasons of the inputs that ingest refused, and of the entries that it left out of archives. Throws
// CorruptSet, IoError.
struct LostInputs {
  std::vector<std::pair<std::string, std::string>> refused, skipped;
};
LostInputs lostInputs(const TileSet& set);
// The segments of all level tiles. O(level tiles).
std::uint64_t levelSegments(const Levels& levels);

}  // namespace filiform::tools
