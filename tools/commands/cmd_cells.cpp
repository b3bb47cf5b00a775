// filiform cells: lists the cells of a tile set.
#include "index/attributes/cell_attributes.h"
#include "index/cell/glob.h"
#include "index/measure/cell_lengths.h"
#include "index/query/cell_graph.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/cell_conditions.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/answer.h"
#include "tools/words/cell_json.h"
#include "tools/words/near_names.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>
#include <variant>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

struct CellsArguments {
  std::shared_ptr<const RemoteArguments> remote;
  std::string set, name = "*", sort;
  std::vector<std::string> where;
  bool json = false, tsv = false, length = false, reverse = false;
};

// Without --length, lengths are measured only if they take at most this many tiles: a second or two.
constexpr std::size_t kMostTilesUnasked = 4096;
constexpr const char* kWhereHelp =
    "list only cells whose attribute meets NAME=VALUE, NAME!=VALUE, NAME<NUMBER, <=, > or >=; VALUE may have * ? [ab]; "
    "measure:FEATURE is a measure, such as measure:length>5000; repeatable: all must hold";
// Rows between two looks at the progress and at interruptions.
constexpr std::size_t kRowsBetween = 4096;

std::vector<std::uint32_t> cellsOf(const TileSet& store, const CellAttributes& attributes,
                                   const CellConditions& conditions, const CellsArguments& a) {
  const std::string& glob = a.name;
  std::vector<std::uint32_t> cells;
  for (const std::uint32_t cell : cellsMeeting(conditions, store, attributes, 0)) {
    if (cell % kRowsBetween == 0) throwIfInterrupted();
    if (store.cell(cell).removed) continue;
    if (glob == "*" || matchesName(glob, store.cell(cell).name)) cells.push_back(cell);
  }
  return cells;
}

// A value to sort by: numbers before texts, and cells without a value last.
using SortKey = std::pair<int, std::variant<double, std::string>>;

SortKey keyOf(const AttributeValue& value) {
  if (isMissing(value)) return {2, 0.0};
  if (const auto number = numberOf(value)) return {0, *number};
  return {1, std::get<std::string>(value)};
}

// Sorts by a column of the list, an attribute or a measure; equal values by id. Throws UsageError, with near names.
void sortCells(const TileSet& set, const CellAttributes& attributes, const CellsArguments& a,
               std::vector<std::uint32_t>& cells) {
  using Count = std::uint64_t CellRecord::*;
  static const std::map<std::string, Count> kCounts{{"samples", &CellRecord::samples},
                                                    {"segments", &CellRecord::segments},
                                                    {"isolated", &CellRecord::isolated},
                                                    {"roots", &CellRecord::roots}};
  std::vector<SortKey> keys;
  const auto of_record = [&](const auto& key) {
    for (const std::uint32_t cell : cells) keys.push_back(key(set.cell(cell)));
  };
  const auto count = kCounts.find(a.sort);
  const auto attribute = attributes.find(a.sort);
  if (a.sort == "id") {
    for (const std::uint32_t cell : cells) keys.emplace_back(0, static_cast<double>(cell));
  } else if (a.sort == "name") {
    of_record([](const CellRecord& cell) { return SortKey(1, cell.name); });
  } else if (count != kCounts.end()) {
    of_record([&](const CellRecord& cell) { return SortKey(0, static_cast<double>(cell.*count->second)); });
  } else if (a.sort.starts_with(kMeasurePrefix)) {
    const Feature& feature = measureNamed(a.sort.substr(kMeasurePrefix.size()), "--sort");
    const std::vector<std::vector<double>> values = valuesOf(set, cells, {&feature}, 0);
    for (const double value : values.at(0)) keys.push_back(std::isnan(value) ? SortKey(2, 0.0) : SortKey(0, value));
  } else if (attribute) {
    for (const std::uint32_t cell : cells) keys.push_back(keyOf(attributes.value(*attribute, cell)));
  } else {
    NearNames near(a.sort);
    for (const auto& [name, member] : kCounts) near.offer(name);
    for (const char* const name : {"id", "name", "measure:length"}) near.offer(name);
    for (const CellAttributes::Column& column : attributes.columns()) near.offer(column.name);
    throw UsageError("--sort " + inShort(a.sort) +
                     ": give id, name, samples, segments, isolated, roots, measure:FEATURE or an attribute" +
                     didYouMean(near.names()));
  }
  std::vector<std::size_t> order(cells.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t x, std::size_t y) {
    if (keys[x].first == 2 || keys[y].first == 2) return keys[x].first < keys[y].first;
    return a.reverse ? keys[y] < keys[x] : keys[x] < keys[y];
  });
  std::vector<std::uint32_t> sorted;
  for (const std::size_t i : order) sorted.push_back(cells[i]);
  cells = std::move(sorted);
}

struct CellRow {
  std::uint32_t id;
  const CellRecord* cell;
  std::optional<double> length_um;
  std::optional<std::array<Vector3d, 2>> box_um;
};

void writeTsv(const CellRow& row, const CellAttributes& attributes) {
  std::cout << row.id << '\t' << escaped(row.cell->name) << '\t' << escaped(row.cell->source) << '\t'
            << row.cell->samples << '\t' << row.cell->segments << '\t' << row.cell->isolated << '\t' << row.cell->roots
            << '\t' << loopsOf(*row.cell) << '\t' << (row.length_um ? formatNumber(*row.length_um) : "-");
  for (int corner = 0; corner < 2; ++corner)
    for (int axis = 0; axis < 3; ++axis)
      std::cout << '\t' << (row.box_um ? formatNumber((*row.box_um)[corner][axis]) : "-");
  for (std::uint32_t column = 0; column < attributes.columns().size(); ++column) {
    const AttributeValue value = attributes.value(column, row.id);
    std::cout << '\t' << (isMissing(value) ? "-" : escaped(filiform::textOf(value)));
  }
  std::cout << '\n';
}

constexpr std::size_t kColumns = 11;
using TextRow = std::array<std::string, kColumns>;
const TextRow kTitles{"id",    "name",       "samples", "segments", "isolated", "roots",
                      "loops", "length, um", "x, um",   "y, um",    "z, um"};

TextRow cellTextOf(const CellRow& row) {
  const auto tenths = [](double value) {
    std::array<char, 48> text{};
    std::snprintf(text.data(), text.size(), "%.1f", value);
    return std::string(text.data());
  };
  TextRow text{std::to_string(row.id),
               escaped(row.cell->name),
               formatCount(row.cell->samples),
               formatCount(row.cell->segments),
               formatCount(row.cell->isolated),
               formatCount(row.cell->roots),
               formatCount(loopsOf(*row.cell)),
               row.length_um ? tenths(*row.length_um) : "-",
               "-",
               "-",
               "-"};
  if (row.box_um)
    for (int axis = 0; axis < 3; ++axis)
      text[8 + static_cast<std::size_t>(axis)] =
          tenths((*row.box_um)[0][axis]) + " to " + tenths((*row.box_um)[1][axis]);
  return text;
}

// Counts characters, not bytes, so that names in UTF-8 line up.
std::size_t widthOf(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

using Widths = std::array<std::size_t, kColumns>;

void widen(Widths& widths, const TextRow& row) {
  for (std::size_t i = 0; i < kColumns; ++i) widths[i] = std::max(widths[i], widthOf(row[i]));
}

void writeText(const TextRow& row, const std::string& source, const Widths& widths) {
  for (std::size_t i = 0; i < kColumns; ++i) {
    const std::string blanks(widths[i] - widthOf(row[i]), ' ');
    std::cout << (i == 1 ? row[i] + blanks : blanks + row[i]) << "  ";
  }
  std::cout << source << '\n';
}

int runCells(const CellsArguments& a) {
  const CellConditions conditions(a.where);  // refuses a wrong condition before the set is read
  const auto set = TileSet::open(a.set, a.remote->options());
  const CellAttributes attributes(*set);
  std::vector<std::uint32_t> cells = cellsOf(*set, attributes, conditions, a);
  if (!a.sort.empty()) sortCells(*set, attributes, a, cells);
  CellLengths lengths(*set, cells);
  const bool measured = a.length || lengths.tiles() <= kMostTilesUnasked;
  if (measured) {
    Progress progress({.title = "lengths", .noun = "tiles", .total = lengths.tiles()});
    lengths.measure([&](std::size_t done) {
      throwIfInterrupted();
      progress.update(done);
    });
    progress.finish();
  }
  const Grid grid = set->grid();
  const auto each = [&](const auto& visit) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (i % kRowsBetween == 0) throwIfInterrupted();
      CellRow row{cells[i], &set->cell(cells[i]), {}, {}};
      if (measured) row.length_um = lengths.of(cells[i]);
      const GridBox& box = row.cell->bounds;
      if (!box.empty()) row.box_um = {grid.toWorld(box.lo), grid.toWorld(box.hi)};
      visit(row);
    }
  };
  if (a.json) {
    const char* separator = "[\n";
    each([&](const CellRow& row) {
      std::cout << std::exchange(separator, ",\n");
      nlohmann::ordered_json json = cellJson(row.id, *row.cell, grid, row.length_um);
      if (!attributes.empty()) json["attributes"] = attributesJson(attributes.of(row.id));
      std::cout << jsonText(json);
    });
    std::cout << (cells.empty() ? "[]\n" : "\n]\n");
  } else if (a.tsv) {
    std::cout << "id\tname\tsource\tsamples\tsegments\tisolated\troots\tloops\tlength_um\tx0\ty0\tz0\tx1\ty1\tz1";
    for (const CellAttributes::Column& column : attributes.columns()) std::cout << '\t' << escaped(column.name);
    std::cout << '\n';
    each([&](const CellRow& row) { writeTsv(row, attributes); });
  } else {
    Widths widths{};
    widen(widths, kTitles);
    each([&](const CellRow& row) { widen(widths, cellTextOf(row)); });
    writeText(kTitles, "source", widths);
    each([&](const CellRow& row) { writeText(cellTextOf(row), escaped(row.cell->source), widths); });
  }
  if (!measured)
    std::cerr << "filiform: note: no lengths: measuring them reads " << counted(lengths.tiles(), "tile")
              << "; --length measures them\n";
  if (!attributes.empty() && !a.json && !a.tsv) {
    std::string names;
    for (const CellAttributes::Column& column : attributes.columns())
      names += (names.empty() ? "" : ", ") + escaped(column.name, 60);
    std::cerr << "filiform: note: --tsv and --json also show the attributes: " << escaped(names, 600) << '\n';
  }
  if (cells.empty() && set->cell_count() > 0 && !a.where.empty())
    std::cerr << "filiform: note: --where matches no cell; the set has " << counted(set->cell_count(), "cell") << "\n";
  else if (cells.empty() && set->cell_count() > 0)
    std::cerr << "filiform: note: --name " << inShort(a.name) << " matches no cell; the set has "
              << counted(set->cell_count(), "cell") << "\n";
  return 0;
}

}  // namespace

void addCells(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<CellsArguments>();
  CLI::App* command = app.add_subcommand("cells", "List the cells of a tile set");
  command->footer(
      "Examples:\n  filiform cells column.fil\n  filiform cells column.fil --name 'cell_0000*' --tsv\n"
      "  filiform cells circuit.fil --where 'layer>=5' --tsv\n"
      "  filiform cells column.fil --where 'measure:tips>20' --sort measure:length --reverse\n"
      "Commands accept the name of a cell, or any part of its name or source that no other cell has.");
  command->add_option("SET", a->set, "tile set, or its address")->required();
  command
      ->add_option(
          "--name", a->name,
          "list the cells whose whole name matches, in any letter case; * stands for any text, ? for any letter, [ab] "
          "for a or b")
      ->type_name("GLOB");
  command->add_option("--where", a->where, kWhereHelp)->type_name("CONDITION")->allow_extra_args(false);
  command->add_flag(
      "--length", a->length,
      "measure the lengths of the cells even if that reads more than " + std::to_string(kMostTilesUnasked) + " tiles");
  CLI::Option* const sort =
      command->add_option("--sort", a->sort, "sort by id, name, samples, segments, measure:FEATURE or an attribute")
          ->type_name("COLUMN");
  command->add_flag("--reverse", a->reverse, "sort from the largest to the smallest value")->needs(sort);
  command->add_flag("--json", a->json, "write one JSON array; tools/README.md lists the fields");
  command->add_flag("--tsv", a->tsv, "write tab-separated rows")->excludes("--json");
  a->remote = addRemoteArguments(*command);
  addProgressOption(*command);
  command->callback([a, &chosen] { chosen = [a] { return runCells(*a); }; });
}

}  // namespace filiform::tools
