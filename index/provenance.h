// Provenance: what a tile set was made from. The set keeps it for people; no reader of the set needs it.
//
// Thread rule: a value. Names may hold any bytes.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

struct Provenance {
  struct Source {
    std::string name;
    std::uint64_t bytes = 0, digest = 0, cells = 0;
    // Passes the dropped lines, entries or `entry:line` to `use`, piece by piece, comma-separated. Empty: none dropped.
    std::function<void(const std::function<void(std::string_view piece)>& use)> dropped = {};
  };
  struct Refused {
    std::string name, code, reason;
  };
  std::vector<Source> sources;
  std::vector<Refused> refused;
  std::map<std::string, std::uint64_t> codes;  // how often each code was reported
};

}  // namespace filiform
