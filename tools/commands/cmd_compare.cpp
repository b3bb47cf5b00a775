// filiform compare: what differs between two sets, or two traces of one neuron.
#include "index/compare/set_changes.h"
#include "index/query/cell_graph.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/commands/shared/scene.h"
#include "tools/program/interruption.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/answer.h"
#include "tools/words/cell_name.h"
#include "tools/words/numbers.h"
#include "tools/words/open_json.h"
#include "tools/words/tables/difference_rows.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <thread>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

constexpr double kUsualWithin_um = 2;
constexpr std::uint64_t kMinCompareMemory = std::uint64_t{64} << 20;

struct CompareArguments {
  std::shared_ptr<const RemoteArguments> remote;
  std::vector<std::string> words;
  std::string within, memory = "1GiB";
  unsigned threads = 0;
  bool json = false, tsv = false;
};

// What is compared: two sets, or a cell of each.
struct Compared {
  std::array<std::string, 2> sets, cells;  // cells: empty for sets
};

Compared comparedBy(const std::vector<std::string>& words) {
  if (words.size() == 2) return {{words[0], words[1]}, {}};
  if (words.size() == 3) return {{words[0], words[0]}, {words[1], words[2]}};
  return {{words.at(0), words.at(2)}, {words.at(1), words.at(3)}};
}

bool areOne(const std::string& a, const std::string& b) {
  std::error_code error;
  return a == b || std::filesystem::equivalent(a, b, error);
}

std::unique_ptr<TileStore> openCompared(const std::string& name, const CompareArguments& a) {
  if (isFileScene(name)) return buildScene(name);
  return TileSet::open(name, a.remote->options());
}

std::optional<std::uint32_t> onlyCell(const TileStore& store) {
  std::optional<std::uint32_t> only;
  for (std::uint32_t cell = 0; cell < store.cell_count(); ++cell) {
    if (store.cell(cell).removed) continue;
    if (only) return std::nullopt;
    only = cell;
  }
  return only;
}

// Writes the rows in the form that was chosen, and their totals.
class DifferenceWriter {
 public:
  DifferenceWriter(const CompareArguments& a, const Compared& compared, double within_um)
      : tsv_(a.tsv), within_um_(within_um) {
    if (tsv_) std::cout << differenceTitles(within_um > 0);
    if (!a.json) return;
    nlohmann::ordered_json head;
    head["a"] = compared.sets[0];
    head["b"] = compared.sets[1];
    head["within_um"] = within_um > 0 ? nlohmann::ordered_json(within_um) : nlohmann::ordered_json();
    json_.emplace(std::cout, head, 0);
    json_->beginList("cells");
  }
  void add(const CellDifference& cell) {
    ++counts_.at(static_cast<std::size_t>(cell.change.kind));
    if (tsv_) {
      std::cout << differenceRow(cell, within_um_ > 0);
    } else if (json_) {
      json_->beginElement();
      std::cout << jsonText(differenceJson(cell, within_um_ > 0));
    } else if (cell.change.kind != CellFate::kSame || cell.distance) {
      std::cout << differenceText(cell, within_um_);
    }
  }
  void end(bool with_totals) {
    if (json_) {
      json_->endList();
      nlohmann::ordered_json totals;
      for (std::size_t i = 0; i < counts_.size(); ++i) totals[std::string(name(static_cast<CellFate>(i)))] = counts_[i];
      json_->member("totals", totals);
      json_->end();
      std::cout << '\n';
    } else if (!tsv_ && with_totals) {
      std::string text;
      for (std::size_t i = 0; i < counts_.size(); ++i)
        (text += text.empty() ? "" : ", ") +=
            formatCount(counts_[i]) + ' ' + std::string(name(static_cast<CellFate>(i)));
      std::cout << "cells: " << text << '\n';
    }
  }

 private:
  bool tsv_;
  double within_um_;
  std::array<std::uint64_t, 5> counts_{};
  std::optional<OpenJson> json_;
};

int runCompare(const CompareArguments& a) {
  const Compared compared = comparedBy(a.words);
  const bool of_cells = !compared.cells[0].empty() || !compared.cells[1].empty();
  double within_um = of_cells ? kUsualWithin_um : 0;
  if (!a.within.empty()) {
    within_um = parseNumber("--within", a.within);
    if (!(within_um > 0)) throw UsageError("--within " + inShort(a.within) + ": the distance must be above 0 um");
  }
  SetChangesOptions options;
  options.memory_bytes = parseBytes("--memory", a.memory);
  if (options.memory_bytes < kMinCompareMemory)
    throw UsageError("--memory " + inShort(a.memory) + ": give at least " + formatBytes(kMinCompareMemory));
  options.threads = a.threads > 0 ? a.threads : std::max(1U, std::thread::hardware_concurrency());
  const bool one_set = areOne(compared.sets[0], compared.sets[1]);
  if (!of_cells && one_set)
    throw UsageError("A and B are the same, " + inShort(compared.sets[0]) +
                     "; give two sets, or one set and two of its cells");

  const std::unique_ptr<TileStore> first = openCompared(compared.sets[0], a);
  const std::unique_ptr<TileStore> opened = one_set ? nullptr : openCompared(compared.sets[1], a);
  const TileStore& second = one_set ? *first : *opened;
  std::array<std::optional<std::uint32_t>, 2> cells;
  if (of_cells) {
    cells = {findCellNamed(*first, compared.cells[0], "CELL"), findCellNamed(second, compared.cells[1], "CELL")};
    if (one_set && cells[0] == cells[1])
      throw UsageError("both are the cell " + inShort(first->cell(*cells[0]).name) + "; name two cells");
  } else {
    cells = {onlyCell(*first), onlyCell(second)};
  }
  if (cells[0] && cells[1]) {  // two traces, whatever their names
    if (!(within_um > 0)) within_um = kUsualWithin_um;
    const TraceDistanceOptions measuring{.within_um = within_um, .check = throwIfInterrupted};
    DifferenceWriter out(a, compared, within_um);
    out.add(differenceOf(readCell(*first, *cells[0], true, &interruptFlag()),
                         readCell(second, *cells[1], true, &interruptFlag()), &measuring));
    out.end(false);
    return 0;
  }
  options.within_um = within_um;
  Progress progress({.title = "compare", .noun = "cells", .total = cellsOfBoth(*first, second)});
  options.check = [&](std::uint64_t done) {
    throwIfInterrupted();
    progress.update(done);
  };
  DifferenceWriter out(a, compared, within_um);
  compareSets(*first, second, options, [&](const CellDifference& cell) { out.add(cell); });
  progress.finish();
  out.end(true);
  return 0;
}

}  // namespace

void addCompare(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<CompareArguments>();
  CLI::App* command = app.add_subcommand("compare", "Compare two sets cell by cell, or two traces of one neuron");
  command->footer(
      "Examples:\n  filiform compare old.fil new.fil\n  filiform compare old.fil new.fil --within 1 --tsv\n"
      "  filiform compare column.fil cell_00042 cell_00005 --within 5\n"
      "  filiform compare old.fil cell_00042 new.fil cell_00042 --json\n"
      "  filiform compare first.swc second.swc\n"
      "Cells of two sets belong together by their names; two sets of one cell each are two traces.\n"
      "A cell is moved if a rotation and a translation bring it to its new place. Distances are between the axes of\n"
      "segments; lengths within a distance are exact. tools/README.md says what the columns are.");
  command
      ->add_option("SET", a->words,
                   "A B: two sets, or their addresses, .swc or .zip files; SET CELL CELL: two cells of a set; A CELL B "
                   "CELL: a cell of each")
      ->required()
      ->expected(2, 4)
      ->type_name("");
  command
      ->add_option("--within", a->within,
                   "measure how much of each trace lies within UM of the other, and how far away it is, also for the "
                   "changed cells of two sets; default for two traces: 2")
      ->type_name("UM");
  CLI::Option* json = command->add_flag("--json", a->json, "write one JSON object; tools/README.md lists the fields");
  command->add_flag("--tsv", a->tsv, "write tab-separated rows")->excludes(json);
  command
      ->add_option("--memory", a->memory,
                   "put cells together in at most this memory; at least 64MiB (K, M, G: KiB, MiB, GiB)")
      ->capture_default_str()
      ->type_name("BYTES");
  command->add_option("--threads", a->threads, "use N threads; 0: one a core")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  a->remote = addRemoteArguments(*command);
  addProgressOption(*command);
  command->callback([a, &chosen] { chosen = [a] { return runCompare(*a); }; });
}

}  // namespace filiform::tools
