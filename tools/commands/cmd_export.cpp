// filiform export: writes cells of a tile set in other formats.
#include "index/errors.h"
#include "index/export/cell_formats.h"
#include "index/export/cell_numbers.h"
#include "index/export/skeleton_format.h"
#include "index/export/skeleton_properties.h"
#include "index/export/skeleton_shards.h"
#include "index/export/zip_writer.h"
#include "index/output.h"
#include "index/query/cell_graph.h"
#include "index/query/cell_pass.h"
#include "index/set/tile_set.h"
#include "index/subsets/subset.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/cell_choice.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/program/output_folder.h"
#include "tools/program/progress.h"
#include "tools/program/progress_option.h"
#include "tools/words/numbers.h"

#include <array>
#include <filesystem>
#include <iostream>
#include <optional>
#include <sstream>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

struct ExportArguments {
  std::shared_ptr<const RemoteArguments> remote;
  std::string set, out, format;
  CellChoice choice;
  bool all = false;
};

enum class FileFormat { swc, edges, obj, vtk };
constexpr std::array<std::pair<FileFormat, const char*>, 4> kFileFormats{
    {{FileFormat::swc, ".swc"}, {FileFormat::edges, ".edges"}, {FileFormat::obj, ".obj"}, {FileFormat::vtk, ".vtk"}}};

const char* endingOf(FileFormat format) { return kFileFormats.at(static_cast<std::size_t>(format)).second; }

struct Destination {
  enum class Kind { kFile, kFolder, kZip, kSkeletons, kShards };
  Kind kind = Kind::kFile;
  FileFormat format = FileFormat::swc;  // for kFile
};

constexpr const char* kShardedFormat = "precomputed";

Destination destinationOf(const std::string& out, const std::string& named_format) {
  std::string name = out;
  while (name.size() > 1 && name.back() == '/') name.pop_back();
  if (named_format == kShardedFormat) {
    if (out == "-" || endsWithNoCase(name, ".zip"))
      throw UsageError("--format precomputed writes a folder: give --output DIR/");
    return {Destination::Kind::kShards};
  }
  if (endsWithNoCase(name, ".precomputed")) return {Destination::Kind::kSkeletons};
  std::error_code error;
  if (name != out || std::filesystem::is_directory(out, error)) return {Destination::Kind::kFolder};
  for (const auto& [format, ending] : kFileFormats)
    if (endsWithNoCase(out, ending)) return {Destination::Kind::kFile, format};
  if (endsWithNoCase(out, ".zip")) return {Destination::Kind::kZip};
  // A device or a pipe may have any name. A name without ending means SWC.
  if (out == "-" || std::filesystem::path(out).extension().empty() || !isFileOutput(out)) return {};
  throw UsageError("--output " + inShort(out) +
                   ": the ending chooses the format: .swc, .edges, .obj or .vtk for one cell; DIR/, ARCHIVE.zip or "
                   "DIR.precomputed for all cells; no ending for SWC");
}

std::optional<FileFormat> formatNamed(const std::string& name) {
  if (name.empty() || name == kShardedFormat) return std::nullopt;
  for (const auto& [format, ending] : kFileFormats)
    if (name == ending + 1) return format;
  throw UsageError("--format " + inShort(name) + ": choose swc, edges, obj, vtk or precomputed");
}

void writeCell(std::ostream& out, const CellGraph& cell, FileFormat format) {
  switch (format) {
    case FileFormat::swc:
      return writeSwc(out, cell);
    case FileFormat::edges:
      return writeEdgeList(out, cell);
    case FileFormat::obj:
      return writeObj(out, cell);
    case FileFormat::vtk:
      return writeVtk(out, cell);
  }
}

// What is written of a set.
struct Exported {
  const TileSet& set;
  std::vector<std::uint32_t> ids;
  std::vector<std::uint16_t> types;  // only samples of these; empty: all
  std::uint64_t samples = 0;         // written so far
};

class ExportedCells {
 public:
  ExportedCells(Exported& exported, std::vector<std::uint32_t> order)
      : exported_(exported), pass_(exported.set, std::move(order), {.check = throwIfInterrupted}) {}
  CellGraph next() {
    throwIfInterrupted();
    CellGraph cell = pass_.next();
    if (!exported_.types.empty()) keepTypes(cell, exported_.types);
    exported_.samples += cell.samples();
    return cell;
  }

 private:
  Exported& exported_;
  CellPass pass_;
};

int exportFile(Exported& exported, const std::string& path, FileFormat format) {
  Output out(path, {.cancel = &interruptFlag()});
  const CellGraph cell = ExportedCells(exported, exported.ids).next();
  writeCell(out.stream(), cell, format);
  out.finish();
  if (!out.isStandardOutput())
    std::cout << escaped(path) << ": " << counted(cell.samples(), "sample") << " of " << escaped(cell.source) << '\n';
  return 0;
}

// The files of several cells. Without --format: SWC, or an edge list if the cell has loops.
class CellFiles {
 public:
  CellFiles(Exported& exported, std::optional<FileFormat> format) : cells_(exported, exported.ids) {
    std::vector<std::string> names;
    for (const std::uint32_t id : exported.ids) {
      const CellRecord& record = exported.set.cell(id);
      names.push_back(record.name);
      formats_.push_back(format.value_or(hasLoops(record) ? FileFormat::edges : FileFormat::swc));
    }
    names_ = safeFileNames(names);
  }
  std::size_t count() const { return names_.size(); }
  std::string name(std::size_t i) const { return names_[i] + endingOf(formats_[i]); }
  // Call it once for each file, in their order.
  std::string text(std::size_t i) {
    std::ostringstream text;
    writeCell(text, cells_.next(), formats_[i]);
    return std::move(text).str();
  }

 private:
  ExportedCells cells_;
  std::vector<FileFormat> formats_;
  std::vector<std::string> names_;
};

void exportZip(CellFiles& files, const std::string& path, Progress& progress) {
  Output out(path, {.by_name = true, .cancel = &interruptFlag()});
  ZipContent content;
  content.entries = files.count();
  content.name = [&](std::size_t i) { return files.name(i); };
  content.text = [&](std::size_t i) { return files.text(i); };
  std::uint64_t done = 0;
  content.written = [&](std::uint64_t) { progress.update(++done); };
  writeZip(out.partialPath(), path, content);
  out.finish();
}

void exportFolder(CellFiles& files, const std::string& path, Progress& progress) {
  OutputFolder folder(path);
  for (std::size_t i = 0; i < files.count(); ++i) {
    folder.write(files.name(i), files.text(i));
    progress.update(i + 1);
  }
  folder.finish();
}

// The cells as Neuroglancer skeletons: one file a cell, or many in a file (shards).
void exportSkeletons(Exported& exported, const std::string& path, bool shards, Progress& progress) {
  const TileSet& set = exported.set;
  const std::vector<std::uint32_t>& ids = exported.ids;
  GridBox bounds;
  std::uint64_t bytes = 0;
  std::vector<std::uint64_t> numbers;
  std::vector<SkeletonCell> cells;
  const CellNumbers cell_numbers(set, throwIfInterrupted);
  for (const std::uint32_t id : ids) {
    const CellRecord& record = set.cell(id);
    bounds.extend(record.bounds);
    bytes += record.samples * 20 + record.segments * 8;
    numbers.push_back(cell_numbers.of(id));
    cells.push_back({numbers.back(), id});
  }
  const SkeletonFormat format(set.grid(), bounds);
  const CellAttributes attributes(set);
  std::optional<SkeletonShards> layout;
  if (shards) layout.emplace(numbers, bytes);
  std::vector<std::uint32_t> in_order = ids;
  if (layout)
    for (std::size_t at = 0; const std::size_t i : layout->order()) in_order[at++] = ids[i];
  ExportedCells cells_in_order(exported, std::move(in_order));
  std::uint64_t done = 0;
  const auto skeleton = [&](std::size_t) {
    std::ostringstream out;
    format.write(out, cells_in_order.next());
    progress.update(++done);
    return std::move(out).str();
  };
  OutputFolder folder(path);
  folder.makeFolder("segment_properties");
  folder.write("segment_properties/info", skeletonProperties(set, cells, &attributes));
  if (layout) {
    folder.write("info", format.info(layout->sharding()));
    for (std::size_t shard = 0; shard < layout->count(); ++shard)
      folder.write(layout->name(shard), layout->content(shard, skeleton));
  } else {
    folder.write("info", format.info());
    for (std::size_t i = 0; i < ids.size(); ++i) folder.write(std::to_string(numbers[i]), skeleton(i));
  }
  folder.finish();
}

int runExport(const ExportArguments& a) {
  const Destination to = destinationOf(a.out, a.format);
  const std::optional<FileFormat> format = formatNamed(a.format);
  const bool one_file = to.kind == Destination::Kind::kFile;
  if (a.all && a.choice.any())
    throw UsageError("--all exports every cell: leave out --cell, --where, --box and --type");
  if (one_file && a.all)
    throw UsageError("--all writes many files: give --output DIR/, ARCHIVE.zip or DIR.precomputed");
  if (one_file && !a.choice.any())
    throw UsageError("name the cell with --cell, or give --output DIR/, ARCHIVE.zip or DIR.precomputed for all cells");
  if (format && (one_file || to.kind == Destination::Kind::kSkeletons))
    throw UsageError("--format is for files in a folder or a zip; here the ending of --output chooses the format");
  if (one_file || to.kind == Destination::Kind::kZip) checkOutputs({{"SET", a.set}}, {{"--output", a.out}});

  const auto set = TileSet::open(a.set, a.remote->options());
  Exported exported{*set, a.choice.select(*set, 0), a.choice.sampleTypes()};
  const std::string cells = counted(exported.ids.size(), "cell");
  if (one_file && exported.ids.size() > 1)
    throw UsageError(inShort(a.out) + " is one file, but " + cells +
                     " are chosen: give --output DIR/, ARCHIVE.zip or DIR.precomputed, or one --cell");
  if (one_file) return exportFile(exported, a.out, to.format);

  Progress progress({.title = "export", .noun = "cells", .total = exported.ids.size()});
  if (to.kind == Destination::Kind::kSkeletons || to.kind == Destination::Kind::kShards) {
    exportSkeletons(exported, a.out, to.kind == Destination::Kind::kShards, progress);
  } else {
    CellFiles files(exported, format);
    to.kind == Destination::Kind::kZip ? exportZip(files, a.out, progress) : exportFolder(files, a.out, progress);
  }
  progress.finish();
  (isStandardOutput(a.out) ? std::cerr : std::cout)
      << inShort(a.out) << ": " << cells << ", " << counted(exported.samples, "sample") << " of " << inShort(a.set)
      << '\n';
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
