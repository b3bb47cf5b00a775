// filiform measure: tables of morphometrics.
#include "index/attributes/cell_attributes.h"
#include "index/export/zip_writer.h"
#include "index/measure/neurite_density.h"
#include "index/output.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/cell_conditions.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/answer.h"
#include "tools/words/cell_name.h"
#include "tools/words/measure_npy.h"
#include "tools/words/measure_table.h"
#include "tools/words/npy.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <thread>
#include <utility>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

struct MeasureArguments {
  std::shared_ptr<const RemoteArguments> remote;
  std::string set, per = "cell", features = kUsualFeatures, type, sholl, npz, density, memory = "256MiB";
  std::vector<std::string> cells, where;
  unsigned threads = 0;
  bool json = false, tsv = false;
};

MeasureChoice choiceOf(const MeasureArguments& a) {
  MeasureChoice choice;
  choice.rows = parseMeasureRows(a.per);
  choice.features = parseFeatures(a.features);
  choice.memory_bytes = parseBytes("--memory", a.memory);
  if (!a.type.empty()) choice.types = parseNeuriteTypes(a.type);
  if (!a.sholl.empty()) {
    choice.sholl_um = parseNumber("--sholl", a.sholl);
    if (!(choice.sholl_um > 0)) throw UsageError("--sholl " + inShort(a.sholl) + ": the step must be above 0 um");
    if (choice.rows == MeasureRows::kBranch)
      throw UsageError("--sholl with --per branch: a Sholl analysis is of a neurite or more; leave one of them out");
  }
  return choice;
}

std::vector<std::uint32_t> chosenCells(const TileSet& set, const CellConditions& conditions,
                                       const MeasureArguments& a) {
  std::vector<std::uint32_t> named;
  for (const std::string& name : a.cells) named.push_back(findCellNamed(set, name, "CELL"));
  std::sort(named.begin(), named.end());
  std::vector<std::uint32_t> cells;
  for (const std::uint32_t cell : cellsMeeting(conditions, set, CellAttributes(set), a.threads))
    if (named.empty() || std::binary_search(named.begin(), named.end(), cell)) cells.push_back(cell);
  return cells;
}

void writeMeasureTsv(const MeasureTable::Row& row) {
  std::string line;
  for (const MeasureTable::Value& value : row) (line += line.empty() ? "" : "\t") += measureText(value);
  std::cout << line << '\n';
}

// For people: in columns.
void writeMeasureText(const std::vector<std::vector<std::string>>& rows) {
  const auto widthOf = [](const std::string& text) {  // characters, not bytes
    return static_cast<std::size_t>(
        std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
  };
  std::vector<std::size_t> widths;
  for (const auto& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (i == widths.size()) widths.push_back(0);
      widths[i] = std::max(widths[i], widthOf(row[i]));
    }
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i)
      std::cout << (i == 0 ? "" : "  ") << std::string(widths[i] - widthOf(row[i]), ' ') << row[i];
    std::cout << '\n';
  }
}

std::string shortText(const MeasureTable::Value& value) {
  if (value.kind != MeasureTable::Value::Kind::kNumber || !std::isfinite(value.number)) return measureText(value);
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), std::abs(value.number) < 100 ? "%.3f" : "%.1f", value.number);
  return text.data();
}

// The rows of the boxes with neurite, or the whole grid as arrays.
void writeDensity(const TileSet& set, const std::vector<std::uint32_t>& cells, const MeasureArguments& a) {
  DensityOptions options{.step_um = parseNumber("--density", a.density),
                         .threads = a.threads > 0 ? a.threads : std::max(1U, std::thread::hardware_concurrency()),
                         .check = throwIfInterrupted};
  if (cells.size() < set.cell_count()) options.cells = cells;
  if (!a.type.empty()) options.types = parseNeuriteTypes(a.type);
  const NeuriteDensity density = densityOf(set, options);
  const Vector3d origin_um = density.corner_um(0, 0, 0);
  const auto bytesOf = [](const auto& numbers, double divided_by) {
    std::string bytes;
    for (const double number : numbers) appendValue(bytes, number / divided_by);
    return bytes;
  };
  if (!a.npz.empty()) {
    Output out(a.npz, {.by_name = true, .cancel = &interruptFlag()});
    writeZip(out.partialPath(), a.npz,
             {.entries = 3,
              .name =
                  [](std::size_t i) {
                    return std::array{"density.npy", "origin.npy", "step.npy"}[i];
                  },
              .text =
                  [&](std::size_t i) {
                    if (i == 0)
                      return npyHeader("'<f8'", density.boxes) + bytesOf(density.lengths_um, density.box_um3());
                    return i == 1 ? npyHeader("'<f8'", 3) + bytesOf(origin_um, 1)
                                  : npyHeader("'<f8'", 1) + bytesOf(std::array{density.step_um}, 1);
                  }});
    out.finish();
    if (!isStandardOutput(a.npz))
      std::cout << inShort(a.npz) << ": " << density.boxes[0] << " x " << density.boxes[1] << " x " << density.boxes[2]
                << " boxes of " << formatNumber(density.step_um) << " um\n";
    return;
  }
  constexpr std::array<const char*, 5> kBoxTitles{"x_um", "y_um", "z_um", "length_um", "density_um_per_um3"};
  const char* separator = "[\n";
  if (!a.json)
    for (const char* title : kBoxTitles) std::cout << title << (title == kBoxTitles.back() ? '\n' : '\t');
  for (std::size_t box = 0; box < density.lengths_um.size(); ++box) {
    const double length_um = density.lengths_um[box];
    if (!(length_um > 0)) continue;
    const Vector3d corner_um = density.cornerOf(box);
    const std::array values{corner_um.x(), corner_um.y(), corner_um.z(), length_um, length_um / density.box_um3()};
    nlohmann::ordered_json json;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (a.json)
        json[kBoxTitles[i]] = values[i];
      else
        std::cout << formatNumber(values[i]) << (i + 1 == values.size() ? '\n' : '\t');
    if (a.json) std::cout << std::exchange(separator, ",\n") << jsonText(json);
  }
  if (a.json) std::cout << (*separator == '[' ? "[]\n" : "\n]\n");
}

int runMeasure(const MeasureArguments& a) {
  const MeasureChoice choice = choiceOf(a);
  const CellConditions conditions(a.where);  // refuses a wrong condition before the set is read
  checkOutputs({{"SET", a.set}}, {{"--npz", a.npz}, {"--json", a.json ? "-" : ""}, {"--tsv", a.tsv ? "-" : ""}});
  const auto set = TileSet::open(a.set, a.remote->options());
  const std::vector<std::uint32_t> cells = chosenCells(*set, conditions, a);
  const MeasureTable table(*set, choice);
  Progress progress({.title = "measure", .noun = "cells", .total = cells.size()});
  const auto each = [&](const auto& visit) {
    table.measure(
        cells, a.threads > 0 ? a.threads : std::max(1U, std::thread::hardware_concurrency()),
        [&](std::size_t done) {
          throwIfInterrupted();
          progress.update(done);
        },
        visit);
    progress.finish();
  };
  if (!a.density.empty()) {
    writeDensity(*set, cells, a);
  } else if (!a.npz.empty()) {
    MeasureArrays arrays(table.columns());
    each([&](const MeasureTable::Row& row) { arrays.add(row); });
    Output out(a.npz, {.by_name = true, .cancel = &interruptFlag()});
    writeZip(out.partialPath(), a.npz,
             {.entries = table.columns().size(),
              .name = [&](std::size_t i) { return table.columns()[i].title + ".npy"; },
              .text = {},
              .bytes = [&](std::size_t i) { return arrays.bytes(i); },
              .parts = [&](std::size_t i) { return arrays.parts(i); }});
    out.finish();
    if (!isStandardOutput(a.npz))
      std::cout << inShort(a.npz) << ": " << counted(arrays.rows(), "row") << " of "
                << counted(table.columns().size(), "array") << '\n';
  } else if (a.json) {
    const char* separator = "[\n";
    each([&](const MeasureTable::Row& row) {
      nlohmann::ordered_json json;
      for (std::size_t i = 0; i < row.size(); ++i) json[table.columns()[i].title] = measureJson(row[i]);
      std::cout << std::exchange(separator, ",\n") << jsonText(json);
    });
    std::cout << (*separator == '[' ? "[]\n" : "\n]\n");
  } else {
    std::vector<std::string> titles;
    for (const MeasureTable::Column& column : table.columns()) titles.push_back(column.title);
    if (a.tsv) {
      std::string line;
      for (const std::string& title : titles) (line += line.empty() ? "" : "\t") += title;
      std::cout << line << '\n';
      each(writeMeasureTsv);
    } else {
      std::vector<std::vector<std::string>> rows{titles};
      each([&](const MeasureTable::Row& row) {
        rows.emplace_back();
        for (const MeasureTable::Value& value : row) rows.back().push_back(shortText(value));
      });
      writeMeasureText(rows);
    }
  }
  if (cells.empty())
    std::cerr << "filiform: note: "
              << (set->cell_count() == 0
                      ? "the set has no cells"
                      : "no cell meets the conditions; the set has " + counted(set->cell_count(), "cell"))
              << '\n';
  return 0;
}

}  // namespace

void addMeasure(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<MeasureArguments>();
  CLI::App* command = app.add_subcommand("measure", "Measure the shapes of cells: lengths, branches, tips, Sholl");
  std::string names;
  std::size_t width = 0;
  for (const Feature& feature : features()) {
    const std::string name(feature.name);
    if (width + name.size() > 110) names += "\n", width = 0;
    names += name + ' ';
    width += name.size() + 1;
  }
  command->footer(
      "Examples:\n  filiform measure column.fil\n  filiform measure column.fil --features all --tsv\n"
      "  filiform measure column.fil CELL --per neurite\n"
      "  filiform measure column.fil --per type --type axon,basal --features length,tips,tortuosity_mean --json\n"
      "  filiform measure column.fil --sholl 10 --per set\n"
      "  filiform measure column.fil --features all --npz measures.npz\n"
      "  filiform measure column.fil --density 50 --type axon --npz density.npz\n"
      "Lengths are um, areas um2, volumes um3, angles rad. A soma, and links from it to neurites, are no part of\n"
      "neurites. index/measure/MEASURES.md defines each feature, with its name in other programs. The features are:\n" +
      names);
  command->add_option("SET", a->set, "tile set, or its address")->required();
  command->add_option("CELL", a->cells, "measure only these cells")->type_name("");
  command
      ->add_option("--where", a->where,
                   "measure only cells whose attribute meets NAME=VALUE, NAME!=VALUE, NAME<NUMBER, <=, > or >=; VALUE "
                   "may have * ? [ab]; measure:FEATURE is a measure; repeatable: all must hold")
      ->type_name("CONDITION")
      ->allow_extra_args(false);
  CLI::Option* per =
      command
          ->add_option("--per", a->per,
                       "write a row for each cell, neurite, branch (section) or type, or one for the set")
          ->type_name("WORD")
          ->capture_default_str();
  command->add_option("--type", a->type, "measure only neurites of these types: axon, basal, apical, or codes of SWC")
      ->type_name("TYPE,...");
  CLI::Option* features_option =
      command->add_option("--features", a->features, "write these features; all: all of them")
          ->type_name("NAME,...")
          ->capture_default_str();
  CLI::Option* sholl =
      command
          ->add_option("--sholl", a->sholl,
                       "count crossings with spheres about the soma, every UM from its surface on; both counts of "
                       "MEASURES.md")
          ->type_name("UM");
  command
      ->add_option(
          "--density", a->density,
          "write the length of neurites in each box of a grid with this edge instead: x y z of the lowest corner, "
          "um, and um per um3; --npz: the whole grid and its origin")
      ->type_name("UM")
      ->excludes(per)
      ->excludes(features_option)
      ->excludes(sholl);
  command
      ->add_option(
          "--memory", a->memory,
          "use at most this memory for the cells that are read at a time; the rest waits in a file in $TMPDIR or /tmp, "
          "14 bytes a segment (K, M, G: KiB, MiB, GiB)")
      ->type_name("BYTES")
      ->capture_default_str();
  command->add_option("--threads", a->threads, "use N threads; 0: one a core")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  CLI::Option* json = command->add_flag("--json", a->json, "write one JSON array; tools/README.md lists the fields");
  CLI::Option* tsv = command->add_flag("--tsv", a->tsv, "write tab-separated rows")->excludes(json);
  command->add_option("--npz", a->npz, "write an archive of NumPy arrays, one a column")
      ->type_name("FILE")
      ->excludes(json)
      ->excludes(tsv);
  a->remote = addRemoteArguments(*command);
  addProgressOption(*command);
  command->callback([a, &chosen] { chosen = [a] { return runMeasure(*a); }; });
}

}  // namespace filiform::tools
