// filiform export: writes cells of a tile set in other formats.
#include "index/errors.h"
#include "index/output.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/cell_choice.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/making/cell_export.h"
#include "tools/words/numbers.h"

#include <iostream>
#include <optional>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

struct ExportArguments {
  std::shared_ptr<const RemoteArguments> remote;
  std::string set, out, format;
  CellChoice choice;
  bool all = false;
};

int runExport(const ExportArguments& a) {
  const ExportPlace to = exportPlaceOf(a.out, a.format);
  const bool one_file = to.kind == ExportPlace::Kind::kFile;
  if (a.all && a.choice.any())
    throw UsageError("--all exports every cell: leave out --cell, --where, --box and --type");
  if (one_file && a.all)
    throw UsageError("--all writes many files: give --output DIR/, ARCHIVE.zip or DIR.precomputed");
  if (one_file && !a.choice.any())
    throw UsageError("name the cell with --cell, or give --output DIR/, ARCHIVE.zip or DIR.precomputed for all cells");

  const auto set = TileSet::open(a.set, a.remote->options());
  CellExport exported{.set = *set,
                      .name = a.set,
                      .cells = a.choice.select(*set, 0),
                      .types = a.choice.sampleTypes(),
                      .output = a.out,
                      .format = a.format,
                      .check = throwIfInterrupted,
                      .cancel = &interruptFlag()};
  const std::size_t count = exported.cells.size();
  std::optional<Progress> progress;
  if (!one_file) {
    progress.emplace(ProgressOptions{.title = "export", .noun = "cells", .total = count});
    exported.progress = [&](std::uint64_t done) { progress->update(done); };
  }
  const std::uint64_t samples = exportCells(exported, to);
  if (one_file) {
    if (!isStandardOutput(a.out))
      std::cout << escaped(a.out) << ": " << counted(samples, "sample") << " of "
                << escaped(set->cell(exported.cells.front()).source) << '\n';
    return 0;
  }
  progress->finish();
  (isStandardOutput(a.out) ? std::cerr : std::cout) << inShort(a.out) << ": " << counted(count, "cell") << ", "
                                                    << counted(samples, "sample") << " of " << inShort(a.set) << '\n';
  return 0;
}

}  // namespace

void addExport(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<ExportArguments>();
  CLI::App* command = app.add_subcommand("export", "Write cells of a tile set in other formats");
  command->footer(
      "Examples:\n  filiform export column.fil --cell cell_00042 -o cell_00042.swc\n"
      "  filiform export column.fil --all -o cells.zip\n"
      "  filiform export column.fil --where 'measure:length>1000' --box -200 0 -200 200 500 200 -o near.zip\n"
      "  filiform export column.fil --type axon -o axons/\n"
      "  filiform export column.fil --all -o column.precomputed\n"
      "  filiform export column.fil --all --format precomputed -o column_web/\n"
      "The ending chooses the format: .swc, .edges (keeps loops), .obj, .vtk. No ending, a device, a pipe or - is "
      "SWC.\n"
      "A cell is exported whole if it has a segment in --box. With --type, a neurite that is cut from its parent "
      "begins "
      "with a root.\n"
      "A folder, DIR/, or ARCHIVE.zip gets one file a cell. DIR.precomputed is a folder of Neuroglancer skeletons, one "
      "file each.\n--format precomputed writes the same skeletons into few files, for any server of files that answers "
      "ranges.");
  command->add_option("SET", a->set, "tile set, or its address")->required();
  addCellChoice(*command, a->choice, "export");
  command->add_flag("--all", a->all, "export every cell, into a folder, a zip or a precomputed folder");
  command->add_option("-o,--output", a->out, "write FILE, DIR/, ARCHIVE.zip or DIR.precomputed; - for standard output")
      ->required()
      ->type_name("FILE");
  command
      ->add_option("--format", a->format,
                   "write the files of a folder or zip as swc, edges, obj or vtk; default: swc, edges for loops. "
                   "precomputed: write a folder of Neuroglancer skeletons in shards")
      ->type_name("FORMAT");
  a->remote = addRemoteArguments(*command);
  addProgressOption(*command);
  command->callback([a, &chosen] { chosen = [a] { return runExport(*a); }; });
}

}  // namespace filiform::tools
