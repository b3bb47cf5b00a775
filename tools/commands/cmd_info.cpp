// filiform info: prints what a tile set holds.
#include "index/errors.h"
#include "index/levels/levels.h"
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "index/streaming/residency.h"
#include "index/text.h"
#include "index/verify/set_digest.h"
#include "solver/force/force_law.h"
#include "solver/proxy/parameters.h"
#include "solver/travel/places/confusion.h"
#include "solver/travel/run/run.h"
#include "solver/workspace/navigation.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/cell_name.h"
#include "tools/words/numbers.h"
#include "tools/words/set_json.h"

#include <algorithm>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

struct InfoArguments {
  std::string path, cell;
  std::shared_ptr<const RemoteArguments> remote;
  bool json = false, parameters = false, sha256 = false;
};

// The default parameters of navigate, and what is measured on the set.
struct Parameters {
  std::string cell;
  SolverParameters solver;
  std::size_t places = 0;
  double confusion_zoom_um = 0, confused_at_300 = 0;
};

Parameters measuredParameters(const TileSet& set, const std::string& cell_name) {
  Parameters p;
  if (set.cell_count() == 0) return p;
  const std::uint32_t cell = cell_name.empty() ? defaultCell(set) : findCellNamed(set, cell_name);
  p.cell = set.cell(cell).name;
  p.solver = automaticParameters(set, cell);
  const Nearest nearest(set);
  const Confusion confusion(set, nearest);
  p.places = confusion.places();
  p.confusion_zoom_um = confusion.largestZoom();
  p.confused_at_300 = confusion.at(300);
  return p;
}

// One parameter, for text and JSON.
struct Row {
  const char* name;
  double value;
  const char* unit;
  const char* note;
};

std::vector<Row> rowsOf(const Parameters& p) {
  const ForceLawOptions force;
  const WorkspaceOptions workspace;
  const NavigationOptions navigation;
  return {{"stiffness_N_m", force.stiffness_N_m, "N/m", "spring to the proxy; 50 with a loose hand"},
          {"damping_Ns_m", force.damping_Ns_m, "N s/m", ""},
          {"max_force_N", force.max_force_N, "N", ""},
          {"max_slew_N_s", force.max_slew_N_s, "N/s", "largest increase, beyond the hand's own motion"},
          {"ramp_s", force.ramp_s, "s", "after a start or jump"},
          {"passivity_energy_J", force.passivity.energy_J, "J", "controller on if the stiffness is outside the bound"},
          {"passivity_power_W", force.passivity.power_W, "W", ""},
          {"passivity_damping_Ns_m", force.passivity.max_damping_Ns_m, "N s/m", ""},
          {"static_fraction", workspace.static_fraction, "", "part of the workspace, in each dimension, without drift"},
          {"drift_speed_m_s", workspace.drift_speed_m_s, "m/s", "largest drift of the workspace; see drift_force"},
          {"drift_force_N_s", navigation.drift_force_N_s, "N/s", ""},
          {"max_visited", static_cast<double>(p.solver.max_visited), "", "segments a tick"},
          {"force_gain", p.solver.gain, "", "force-based: r = min(r_max, G |q-h| + r_min)"},
          {"force_r_min_um", p.solver.r_min_um, "um", "5th percentile of the cell's segment lengths"},
          {"force_r_max_um", p.solver.r_max_um, "um", "95th percentile"},
          {"confusion_places", static_cast<double>(p.places), "", "places sampled"},
          {"confused_at_300_um", p.confused_at_300, "", "fraction of the places confused at 300 um across 12 cm"},
          {"confusion_zoom_um", p.confusion_zoom_um, "um",
           "across 12 cm: 5 % of the places are confused; zoom in further"}};
}

void printParameters(const Parameters& p) {
  std::cout << "automatic parameters, cell " << escaped(p.cell) << '\n';
  for (const Row& row : rowsOf(p)) {
    const std::string value = formatNumber(std::round(row.value * 1e6) / 1e6) + (*row.unit ? " " : "") + row.unit;
    std::cout << "  " << row.name << std::string(24 - std::string_view(row.name).size(), ' ') << value;
    if (*row.note) std::cout << std::string(value.size() < 16 ? 16 - value.size() : 1, ' ') << row.note;
    std::cout << '\n';
  }
}

std::string digestOf(const TileSet& set) {
  Progress progress(ProgressOptions{.title = "reading", .noun = "", .total = set.bytes()});
  return setDigest(set, [&](std::uint64_t done) {
    if (interruptFlag()) throw Interrupted("interrupted");
    progress.update(done);
  });
}

void writeInfoJson(const TileSet& set, const Levels* levels, const InfoArguments& a) {
  nlohmann::ordered_json info = setJson(set, levels);
  if (a.sha256) info["sha256"] = digestOf(set);
  if (a.parameters) {
    const Parameters p = measuredParameters(set, a.cell);
    auto& json = info["parameters"];
    json["cell"] = p.cell;
    for (const Row& row : rowsOf(p)) json[row.name] = row.value;
  }
  std::cout << info.dump(1, ' ', true, nlohmann::json::error_handler_t::replace) << '\n';
}

void printLine(const char* what, const std::string& value, const std::string& note = "") {
  std::cout << "  " << what << std::string(18 - std::string_view(what).size(), ' ') << value << note << '\n';
}

// Names the first 20 inputs and their reasons.
void printInputs(const std::vector<std::pair<std::string, std::string>>& inputs) {
  for (std::size_t i = 0; i < std::min<std::size_t>(inputs.size(), 20); ++i)
    std::cout << "    " << escaped(inputs[i].first) << ": " << inputs[i].second << '\n';
}

void printLevels(const Levels& levels) {
  printLine("levels", formatCount(levels.size()), "  tiles of simplified neurites, for viewing");
  printLine("  segments", formatCount(levelSegments(levels)));
  printLine("  on disk", formatBytes(levels.bytes()));
  if (levels.size() > 0) {
    const LevelEntry& top = levels.entry(0);
    printLine("  coarsest", formatCount(top.segments),
              ("  segments within " + formatNumber(std::round(top.error_um * 100) / 100) + " um, " +
               formatCount(top.hidden) + " of " + formatCount(top.hidden + top.represented) + " hidden by others"));
  }
}

void printInfo(const TileSet& set, const Levels* levels, const InfoArguments& a) {
  const SetCounts& n = set.counts();
  std::cout << escaped(a.path) << "  (revision " << set.revision() << ")\n";
  printLine("cells", formatCount(n.cells));
  printLine("samples", formatCount(n.samples));
  printLine("segments", formatCount(n.segments));
  if (n.isolated > 0) printLine("isolated", formatCount(n.isolated), "  (samples without any link)");
  printLine("roots", formatCount(n.roots));
  if (!set.bounds().empty()) {
    const Vector3d lo = set.grid().toWorld(set.bounds().lo), hi = set.grid().toWorld(set.bounds().hi);
    for (int axis = 0; axis < 3; ++axis)
      printLine(axis == 0   ? "x from, to"
                : axis == 1 ? "y from, to"
                            : "z from, to",
                formatNumber(std::round(lo[axis] * 100) / 100) + "  " + formatNumber(std::round(hi[axis] * 100) / 100),
                "  um");
  }
  printLine("tiles", formatCount(n.tiles), "");
  printLine("capacity", formatCount(set.capacity()), "  segments a tile");
  printLine("ghosts", formatCount(n.stored_segments - n.segments - n.isolated),
            "  segments stored again in a tile that they cross");
  printLine("grid", formatNumber(set.grid().quantum_um() * 1000) + " nm");
  if (levels) printLevels(*levels);
  printLine("on disk", formatBytes(set.bytes()));
  printLine("in memory", formatBytes(n.decoded_bytes), "  if all tiles were resident");
  printLine("smallest budget", formatBytes(Residency::floorBytes(set)), "  for navigate --budget");
  const LostInputs lost = lostInputs(set);
  printLine("refused inputs", formatCount(set.refused()));
  printInputs(lost.refused);
  if (set.skipped() > 0) printLine("skipped inputs", formatCount(set.skipped()), "  entries left out of archives");
  printInputs(lost.skipped);
  if (a.sha256) printLine("sha256", digestOf(set), "  of all bytes; verify --sha256 compares");
  if (a.parameters) printParameters(measuredParameters(set, a.cell));
}

int runInfo(const InfoArguments& a) {
  const auto set = TileSet::open(a.path, a.remote->options());
  const std::unique_ptr<Levels> levels = Levels::open(*set);
  a.json ? writeInfoJson(*set, levels.get(), a) : printInfo(*set, levels.get(), a);
  return 0;
}

}  // namespace

void addInfo(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<InfoArguments>();
  CLI::App* command = app.add_subcommand("info", "Print what a tile set holds");
  command->footer("Examples:\n  filiform info column.fil --json\n  filiform info column.fil --parameters");
  command->add_option("SET", a->path, "tile set, or its address")->required();
  command->add_flag("--json", a->json, "write one JSON object; tools/README.md lists the fields");
  CLI::Option* parameters = command->add_flag(
      "--parameters", a->parameters,
      "print also the default parameters of navigate, and the zoom at which a trembling hand confuses "
      "one neurite with another in 5 % of places (reads some hundred tiles: seconds)");
  command->add_flag(
      "--sha256", a->sha256,
      "print also the SHA-256 of all bytes of the set, which verify --sha256 compares (reads every byte)");
  command->add_option("--cell", a->cell, "print the parameters of this cell; default: the cell with the most segments")
      ->needs(parameters);
  a->remote = addRemoteArguments(*command);
  addProgressOption(*command);
  command->callback([a, &chosen] { chosen = [a] { return runInfo(*a); }; });
}

}  // namespace filiform::tools
