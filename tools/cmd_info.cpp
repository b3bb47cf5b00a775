// filiform info: what a tile set holds.
#include "index/residency.h"
#include "index/text.h"
#include "index/tile_set.h"
#include "tools/cli.h"

#include <algorithm>
#include <iostream>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

int runInfo(const std::string& path, bool as_json) {
  const auto set = TileSet::open(path);
  const SetCounts& n = set->counts();
  const auto manifest = nlohmann::json::parse(set->manifest());
  const auto& refused_inputs = manifest.at("provenance").at("refused");
  const std::size_t refused = refused_inputs.size();
  if (as_json) {
    const nlohmann::ordered_json info{{"cells", n.cells},
                                      {"samples", n.samples},
                                      {"segments", n.segments},
                                      {"isolated", n.isolated},
                                      {"roots", n.roots},
                                      {"tiles", n.tiles},
                                      {"stored_segments", n.stored_segments},
                                      {"bytes", set->bytes()},
                                      {"decoded_bytes", n.decoded_bytes},
                                      {"quantum_um", set->grid().quantum_um()},
                                      {"capacity", set->capacity()},
                                      {"refused", refused}};
    std::cout << info.dump(1) << '\n';
    return 0;
  }
  const auto line = [](const char* what, const std::string& value, const char* note = "") {
    std::cout << "  " << what << std::string(18 - std::string_view(what).size(), ' ') << value << note << '\n';
  };
  std::cout << escaped(path) << "  (revision " << set->revision() << ")\n";
  line("cells", formatCount(n.cells));
  line("samples", formatCount(n.samples));
  line("segments", formatCount(n.segments));
  if (n.isolated > 0) line("isolated", formatCount(n.isolated), "  (samples without any link)");
  line("roots", formatCount(n.roots));
  if (!set->bounds().empty()) {
    const Vector3d lo = set->grid().toWorld(set->bounds().lo), hi = set->grid().toWorld(set->bounds().hi);
    for (int axis = 0; axis < 3; ++axis)
      line(axis == 0   ? "x from, to"
           : axis == 1 ? "y from, to"
                       : "z from, to",
           formatNumber(std::round(lo[axis] * 100) / 100) + "  " + formatNumber(std::round(hi[axis] * 100) / 100),
           "  um");
  }
  line("tiles", formatCount(n.tiles), "");
  line("capacity", formatCount(set->capacity()), "  segments a tile");
  line("ghosts", formatCount(n.stored_segments - n.segments - n.isolated),
       "  segments stored again in a tile that they cross");
  line("grid", formatNumber(set->grid().quantum_um() * 1000) + " nm");
  line("on disk", formatBytes(set->bytes()));
  line("in memory", formatBytes(n.decoded_bytes), "  if all tiles were resident");
  line("smallest budget", formatBytes(Residency::floorBytes(*set)), "  for navigate --budget");
  line("refused inputs", formatCount(refused));
  for (std::size_t i = 0; i < std::min<std::size_t>(refused, 20); ++i) {
    const auto& one = refused_inputs[i];
    std::cout << "    " << escaped(one.at("name").get<std::string>()) << ": " << one.at("reason").get<std::string>()
              << '\n';
  }
  return 0;
}

}  // namespace

void addInfo(CLI::App& app, Chosen& chosen) {
  auto path = std::make_shared<std::string>();
  auto as_json = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand("info", "What a tile set holds");
  command->footer("Example:\n  filiform info column.fil --json");
  command->add_option("SET", *path, "tile set")->required();
  command->add_flag("--json", *as_json, "one JSON object, fields as in tools/README.md");
  command->callback([path, as_json, &chosen] { chosen = [path, as_json] { return runInfo(*path, *as_json); }; });
}

}  // namespace filiform::tools
