// The options of a search's filter: --cell, --not-cell, --type and --where. Thread rule: thread-compatible.
#pragma once

#include "index/query/segment_filter.h"

#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace filiform {
class TileSet;
}

namespace filiform::tools {

struct FilterArguments {
  std::vector<std::string> cells, not_cells, types, where;
  std::vector<CLI::Option*> options;  // of the command

  // Throws as findCellNamed(), parseSegmentTypes() and CellConditions. Writes a note if no cell is left.
  SegmentFilter filter(const TileSet& set, unsigned threads) const;
};

std::shared_ptr<const FilterArguments> addFilterArguments(CLI::App& command);

}  // namespace filiform::tools
