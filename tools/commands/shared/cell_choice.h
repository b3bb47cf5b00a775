// Which cells of a set a command copies, and which of their samples: --cell, --where, --box and --type. Thread rule:
// thread-compatible.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace CLI {
class App;
}  // namespace CLI

namespace filiform {
class TileSet;
}

namespace filiform::tools {

struct CellChoice {
  std::vector<std::string> cells{}, where{}, box{}, types{};  // as they were given

  bool any() const { return !cells.empty() || !where.empty() || !box.empty() || !types.empty(); }
  // The SWC types of the samples; empty: all. Throws UsageError.
  std::vector<std::uint16_t> sampleTypes() const;
  // The ids of the cells that meet all options, ascending. `threads`: 0: one a core. Shows progress. Throws UsageError,
  // with near names, if there are none; Interrupted; what the set throws.
  std::vector<std::uint32_t> select(const TileSet& set, unsigned threads) const;
};

// Adds --cell and --type to the command; `does` begins their help: "export".
void addCellAndType(CLI::App& command, std::vector<std::string>& cells, std::vector<std::string>& types,
                    const std::string& does);
// Adds --where and --box too.
void addCellChoice(CLI::App& command, CellChoice& choice, const std::string& does);

}  // namespace filiform::tools
