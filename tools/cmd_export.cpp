// filiform export: a cell of a tile set back as SWC, or as an edge list.
#include "index/cell_graph.h"
#include "index/edge_list.h"
#include "index/errors.h"
#include "index/text.h"
#include "index/tile_set.h"
#include "tools/cli.h"

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <iostream>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

int runExport(const std::string& set_path, const std::string& name, const std::string& out) {
  const auto set = TileSet::open(set_path);
  const std::uint32_t id = findCellNamed(*set, name);
  const CellGraph cell = readCell(*set, id, true);
  if (out == "-") {
    writeSwc(std::cout, cell);
    return 0;
  }
  const std::string partial = out + ".partial";
  std::ofstream file(partial, std::ios::binary);
  if (!file) throw IoError(escaped(partial), "cannot write", errno);
  try {
    if (endsWithNoCase(out, ".edges")) {
      writeEdgeList(file, cell);
    } else {
      writeSwc(file, cell);
    }
  } catch (...) {
    std::remove(partial.c_str());
    throw;
  }
  file.close();
  if (!file || std::rename(partial.c_str(), out.c_str()) != 0) {
    const int error = errno;
    std::remove(partial.c_str());
    throw IoError(escaped(out), "cannot write", error);
  }
  std::cout << escaped(out) << ": " << formatCount(cell.samples()) << " samples of " << escaped(cell.source) << '\n';
  return 0;
}

}  // namespace

void addExport(CLI::App& app, Chosen& chosen) {
  struct Arguments {
    std::string set, cell, out;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("export", "Write a cell of a tile set back as SWC, or as an edge list");
  command->footer("Example:\n  filiform export column.fil --cell cell_00042 -o cell_00042.swc");
  command->add_option("SET", a->set, "tile set")->required();
  command->add_option("--cell", a->cell, "name of the cell")->required();
  command
      ->add_option("-o,--output", a->out,
                   "file to write: an edge list if it ends in .edges, otherwise SWC; - for SWC to standard output")
      ->required()
      ->type_name("FILE");
  command->callback([a, &chosen] { chosen = [a] { return runExport(a->set, a->cell, a->out); }; });
}

}  // namespace filiform::tools
