// Provenance: the inputs from which a tile set was made. The set stores it for its users; no reader of a set needs it.
//
// Thread rule: a value. Names may contain any bytes.
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
    // Passes the dropped lines, entries or `entry:line` to `use` in pieces, comma-separated. Empty: nothing was
    // dropped.
    std::function<void(const std::function<void(std::string_view piece)>& use)> dropped = {};
  };
  struct Lost {
    std::string name, code, reason;
  };
  std::vector<Source> sources;
  std::vector<Lost> refused, skipped;
  std::map<std::string, std::uint64_t> codes;        // number of reports by code
  std::map<std::string, std::uint64_t> passed_over;  // number of files that were no inputs, by ending
  // Sources that give no cells now: lost ones, and files passed over that by their names may hold cells. Not stored.
  std::vector<std::string> unusable;
};

}  // namespace filiform
