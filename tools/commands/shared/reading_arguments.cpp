#include "tools/commands/shared/reading_arguments.h"

#include "index/errors.h"
#include "index/formats/neuroglancer/object_ids.h"
#include "index/text.h"
#include "tools/words/making/making.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

namespace filiform::tools {

void ReadingArguments::apply(InputOptions& options) const {
  options.versions = morphologyVersion(version, "--version");
  options.remote = remote->options();
  options.where = where;
  if (!box.empty()) {
    std::vector<double> c;
    for (const std::string& word : box) c.push_back(parseNumber("--box", word));
    const Vector3d a(c.at(0), c.at(1), c.at(2)), b(c.at(3), c.at(4), c.at(5));
    options.box_um = {a.cwiseMin(b), a.cwiseMax(b)};
  }
  if (ids.empty()) return;
  std::ifstream in(ids, std::ios::binary);
  if (!in) throw IoError("--ids " + inShort(ids), "cannot open", errno);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  std::vector<std::uint64_t> wanted = readObjectIds(text, ids);
  std::sort(wanted.begin(), wanted.end());
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  options.ids = std::make_shared<const std::vector<std::uint64_t>>(std::move(wanted));
}

std::shared_ptr<ReadingArguments> addReadingArguments(CLI::App& command, bool with_sets) {
  auto a = std::make_shared<ReadingArguments>();
  command
      .add_option(
          "--version", a->version,
          "of neurons that a NeuroMorpho archive holds twice, read the standardised one (cng), the source or both")
      ->check(CLI::IsMember({"cng", "source", "both"}))
      ->capture_default_str();
  command.add_option("--ids", a->ids, "of precomputed skeletons, read the objects in this file, one id a line")
      ->type_name("FILE");
  const std::string of_sets = with_sets ? "; of a tile set, read the cells " : "";
  command
      .add_option("--where", a->where,
                  "of precomputed skeletons, read the objects whose segment properties meet a condition, such as "
                  "type=L5_*, layer>=4" +
                      (with_sets ? of_sets + "whose attributes or measures do, as measure:length>5000" : of_sets) +
                      "; repeatable: all must hold")
      ->type_name("CONDITION")
      ->allow_extra_args(false);
  command
      .add_option("--box", a->box,
                  "of precomputed skeletons, read the objects that their spatial index places in a box, um" +
                      (with_sets ? of_sets + "that have a segment in the box, whole" : of_sets))
      ->expected(6)
      ->type_name("X0 Y0 Z0 X1 Y1 Z1");
  a->remote = addRemoteArguments(command);
  return a;
}

void addCircuitArguments(CLI::App& command, CircuitOptions& circuit, bool& no_soma_links) {
  command.add_option("--population", circuit.population, "read only this population of a circuit or of nodes.h5")
      ->type_name("NAME");
  command
      .add_option("--morphologies", circuit.morphologies,
                  "find the morphologies of nodes.h5, or of a circuit, in this folder or H5 container")
      ->type_name("PATH");
  command.add_flag("--no-soma-links", no_soma_links,
                   "do not link the soma to its neurites in formats that state no such links (H5, ASC)");
}

}  // namespace filiform::tools
