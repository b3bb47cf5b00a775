#include "tools/commands/shared/filter_arguments.h"

#include "index/attributes/cell_attributes.h"
#include "index/set/tile_set.h"
#include "tools/commands/shared/cell_conditions.h"
#include "tools/words/cell_name.h"
#include "tools/words/filter_words.h"

#include <iostream>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>

namespace filiform::tools {

SegmentFilter FilterArguments::filter(const TileSet& set, unsigned threads) const {
  FilterParts parts;
  std::string all_types;
  for (const std::string& some : types) all_types += (all_types.empty() ? "" : ",") + some;
  if (!types.empty()) parts.types = parseSegmentTypes(all_types, ',', "--type");
  for (const std::string& name : cells) parts.cells.push_back(findCellNamed(set, name, "--cell"));
  for (const std::string& name : not_cells) parts.not_cells.push_back(findCellNamed(set, name, "--not-cell"));
  if (!where.empty()) parts.met = cellsMeeting(CellConditions(where), set, CellAttributes(set), threads);
  SegmentFilter filter = filterOf(set.cell_count(), std::move(parts));
  if (filter.cells && filter.cells->empty()) std::cerr << "filiform: note: no cell meets the conditions\n";
  return filter;
}

std::shared_ptr<const FilterArguments> addFilterArguments(CLI::App& command) {
  auto a = std::make_shared<FilterArguments>();
  const auto add = [&](const char* name, std::vector<std::string>& words, const char* help, const char* type) {
    a->options.push_back(command.add_option(name, words, help)->type_name(type)->allow_extra_args(false));
  };
  add("--cell", a->cells, "find only segments of this cell; repeatable", "NAME");
  add("--not-cell", a->not_cells, "find no segments of this cell; repeatable", "NAME");
  add("--type", a->types,
      "find only segments of these types: axon, basal, apical, dendrite, soma, undefined, or codes of SWC; repeatable",
      "TYPE,...");
  add("--where", a->where,
      "find only segments of cells whose attribute meets NAME=VALUE, NAME!=VALUE, NAME<NUMBER, <=, > or >=; VALUE may "
      "have * ? [ab]; measure:FEATURE is a measure; repeatable: all must hold",
      "CONDITION");
  return a;
}

}  // namespace filiform::tools
