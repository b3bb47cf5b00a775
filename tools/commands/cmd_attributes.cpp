// filiform attributes: gives the cells of a set the attributes of a table.
#include "index/errors.h"
#include "index/ingest/set_attributes.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/words/answer.h"
#include "tools/words/numbers.h"

#include <iostream>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

struct AttributesArguments {
  std::string set, table, key;
  bool replace = false, json = false;
};

std::string columnText(const SetAttributesResult::Column& column) {
  std::string text = "  " + escaped(column.name, 80) + " (" + std::string(name(column.type)) +
                     (column.is_new ? ", new" : "") + "): given to " + counted(column.given, "cell");
  if (column.replaced > 0) text += ", replaced in " + formatCount(column.replaced);
  if (column.same > 0) text += ", the same as before in " + formatCount(column.same);
  if (column.empty > 0) text += ", empty in the table for " + formatCount(column.empty);
  return text + "\n";
}

nlohmann::ordered_json jsonOf(const AttributeTable& table, const SetAttributesResult& result) {
  nlohmann::ordered_json columns = nlohmann::ordered_json::array();
  for (const SetAttributesResult::Column& c : result.columns)
    columns.push_back({{"name", c.name},
                       {"type", std::string(name(c.type))},
                       {"new", c.is_new},
                       {"given", c.given},
                       {"replaced", c.replaced},
                       {"same", c.same},
                       {"empty", c.empty}});
  return {{"revision", result.revision},
          {"unchanged", result.unchanged},
          {"cells_with_row", result.with_row},
          {"cells_without_row", result.without_row},
          {"rows_without_cell", result.rows_without_cell},
          {"rows_repeated", table.repeated()},
          {"attributes", columns}};
}

int runAttributes(const AttributesArguments& a) {
  refuseAddress("SET", a.set);
  const AttributeTable table = AttributeTable::read(a.table, a.key);
  const SetAttributesResult result = setAttributes(table, a.set, a.replace);
  if (a.json) {
    std::cout << jsonText(jsonOf(table, result)) << '\n';
    return 0;
  }
  std::cout << escaped(a.set) << ": cells with a row of " << inShort(table.file()) << ": "
            << formatCount(result.with_row) << ", without: " << formatCount(result.without_row)
            << "; rows without a cell: " << formatCount(result.rows_without_cell);
  if (table.repeated() > 0)
    std::cout << "; rows left out, because their key came before: " << formatCount(table.repeated());
  std::cout << (result.unchanged ? " (unchanged: the same attributes as before)\n" : "\n");
  for (const SetAttributesResult::Column& column : result.columns) std::cout << columnText(column);
  return 0;
}

}  // namespace

void addAttributes(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<AttributesArguments>();
  CLI::App* command = app.add_subcommand("attributes", "Give the cells of a tile set the attributes of a table");
  command->footer(
      "Examples:\n  filiform attributes column.fil --table types.csv --key cell\n"
      "  filiform attributes column.fil --table types.csv --key cell --replace\n"
      "A row belongs to the cell whose name is the text in the column of --key. Other cells and other attributes keep "
      "their values, and so does a cell whose field is empty.\n"
      "Without --replace, a cell that has another value already ends the command, and the set stays as it is.");
  command->add_option("SET", a->set, "tile set")->required();
  command->add_option("--table", a->table, "table of attributes, CSV or TSV; its first line names the columns")
      ->required()
      ->type_name("TABLE");
  command->add_option("--key", a->key, "the column that holds the names of cells, as neuron_name")
      ->required()
      ->type_name("COLUMN");
  command->add_flag("--replace", a->replace, "replace values that cells have already");
  command->add_flag("--json", a->json, "write one JSON object");
  command->callback([a, &chosen] { chosen = [a] { return runAttributes(*a); }; });
}

}  // namespace filiform::tools
