#include "tools/words/making/cell_export.h"

#include "index/attributes/cell_attributes.h"
#include "index/count_text.h"
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
#include "tools/words/making/output_folder.h"

#include <array>
#include <filesystem>
#include <optional>
#include <sstream>
#include <utility>

namespace filiform::tools {

namespace {

using FileFormat = ExportPlace::Format;
constexpr std::array<std::pair<FileFormat, const char*>, 4> kFileFormats{
    {{FileFormat::swc, ".swc"}, {FileFormat::edges, ".edges"}, {FileFormat::obj, ".obj"}, {FileFormat::vtk, ".vtk"}}};

const char* endingOf(FileFormat format) { return kFileFormats.at(static_cast<std::size_t>(format)).second; }

constexpr const char* kShardedFormat = "precomputed";

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

class ExportedCells {
 public:
  ExportedCells(const CellExport& exported, std::vector<std::uint32_t> order)
      : exported_(exported), pass_(exported.set, std::move(order), {.check = exported.check}) {}
  CellGraph next() {
    if (exported_.check) exported_.check();
    CellGraph cell = pass_.next();
    if (!exported_.types.empty()) keepTypes(cell, exported_.types);
    samples_ += cell.samples();
    return cell;
  }
  std::uint64_t samples() const { return samples_; }  // written so far

 private:
  const CellExport& exported_;
  CellPass pass_;
  std::uint64_t samples_ = 0;
};

std::uint64_t exportFile(const CellExport& exported, FileFormat format) {
  Output out(exported.output, {.cancel = exported.cancel});
  const CellGraph cell = ExportedCells(exported, exported.cells).next();
  writeCell(out.stream(), cell, format);
  out.finish();
  return cell.samples();
}

// The files of several cells. Without --format: SWC, or an edge list if the cell has loops.
class CellFiles {
 public:
  CellFiles(const CellExport& exported, std::optional<FileFormat> format) : cells_(exported, exported.cells) {
    std::vector<std::string> names;
    for (const std::uint32_t id : exported.cells) {
      const CellRecord& record = exported.set.cell(id);
      names.push_back(record.name);
      formats_.push_back(format.value_or(hasLoops(record) ? FileFormat::edges : FileFormat::swc));
    }
    names_ = safeFileNames(names);
  }
  std::size_t count() const { return names_.size(); }
  std::uint64_t samples() const { return cells_.samples(); }
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

void tell(const CellExport& exported, std::uint64_t done) {
  if (exported.progress) exported.progress(done);
}

void exportZip(CellFiles& files, const CellExport& exported) {
  Output out(exported.output, {.by_name = true, .cancel = exported.cancel});
  ZipContent content;
  content.entries = files.count();
  content.name = [&](std::size_t i) { return files.name(i); };
  content.text = [&](std::size_t i) { return files.text(i); };
  std::uint64_t done = 0;
  content.written = [&](std::uint64_t) { tell(exported, ++done); };
  writeZip(out.partialPath(), exported.output, content);
  out.finish();
}

void exportFolder(CellFiles& files, const CellExport& exported) {
  OutputFolder folder(exported.output);
  for (std::size_t i = 0; i < files.count(); ++i) {
    folder.write(files.name(i), files.text(i));
    tell(exported, i + 1);
  }
  folder.finish();
}

// The cells as Neuroglancer skeletons: one file a cell, or many in a file (shards).
std::uint64_t exportSkeletons(const CellExport& exported, bool shards) {
  const TileSet& set = exported.set;
  const std::vector<std::uint32_t>& ids = exported.cells;
  GridBox bounds;
  std::uint64_t bytes = 0;
  std::vector<std::uint64_t> numbers;
  std::vector<SkeletonCell> cells;
  const CellNumbers cell_numbers(set, exported.check);
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
    tell(exported, ++done);
    return std::move(out).str();
  };
  OutputFolder folder(exported.output);
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
  return cells_in_order.samples();
}

std::optional<FileFormat> formatNamed(const std::string& name) {
  if (name.empty() || name == kShardedFormat) return std::nullopt;
  for (const auto& [format, ending] : kFileFormats)
    if (name == ending + 1) return format;
  throw UsageError("--format " + inShort(name) + ": choose swc, edges, obj, vtk or precomputed");
}

bool isDevice(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error);
}

// Files are compared, not names: links and other spellings count.
void refuseFileOfSet(const CellExport& exported) {
  namespace fs = std::filesystem;
  const std::string target = outputPlace(exported.output).target;
  std::error_code error, ignored;
  if (exported.set.isRemote() || !fs::is_regular_file(target, error)) return;
  constexpr auto kFollow = fs::directory_options::follow_directory_symlink;
  for (fs::recursive_directory_iterator at(exported.name, kFollow, error), end; !error && at != end;
       at.increment(error))
    if (fs::equivalent(at->path(), target, ignored))
      throw UsageError("--output " + inShort(exported.output) +
                       ": is a file of the tile set, the input; name another file");
}

ExportPlace placeByEnding(const std::string& out, const std::string& named_format) {
  std::string name = out;
  while (name.size() > 1 && name.back() == '/') name.pop_back();
  if (named_format == kShardedFormat) {
    if (out == "-" || endsWithNoCase(name, ".zip"))
      throw UsageError("--format precomputed writes a folder: give --output DIR/");
    return {ExportPlace::Kind::kShards};
  }
  if (endsWithNoCase(name, ".precomputed")) return {ExportPlace::Kind::kSkeletons};
  std::error_code error;
  if (name != out || std::filesystem::is_directory(out, error)) return {ExportPlace::Kind::kFolder};
  for (const auto& [format, ending] : kFileFormats)
    if (endsWithNoCase(out, ending)) return {ExportPlace::Kind::kFile, format};
  if (endsWithNoCase(out, ".zip")) return {ExportPlace::Kind::kZip};
  // A device or a pipe may have any name. A name without ending means SWC.
  if (out == "-" || std::filesystem::path(out).extension().empty() || isDevice(out)) return {};
  throw UsageError("--output " + inShort(out) +
                   ": the ending chooses the format: .swc, .edges, .obj or .vtk for one cell; DIR/, ARCHIVE.zip or "
                   "DIR.precomputed for all cells; no ending for SWC");
}

}  // namespace

ExportPlace exportPlaceOf(const std::string& output, const std::string& format) {
  const ExportPlace place = placeByEnding(output, format);
  if (formatNamed(format) && (place.kind == ExportPlace::Kind::kFile || place.kind == ExportPlace::Kind::kSkeletons))
    throw UsageError("--format is for files in a folder or a zip; here the ending of --output chooses the format");
  return place;
}

std::uint64_t exportCells(const CellExport& exported, const ExportPlace& place) {
  if (exported.cells.empty()) throw UsageError("no cell is chosen");
  const bool one_file = place.kind == ExportPlace::Kind::kFile;
  if (one_file || place.kind == ExportPlace::Kind::kZip) refuseFileOfSet(exported);
  if (one_file && exported.cells.size() != 1)
    throw UsageError(inShort(exported.output) + " is one file, but " + counted(exported.cells.size(), "cell") +
                     " are chosen: give --output DIR/, ARCHIVE.zip or DIR.precomputed, or one --cell");
  if (one_file) return exportFile(exported, place.format);
  if (place.kind == ExportPlace::Kind::kSkeletons || place.kind == ExportPlace::Kind::kShards)
    return exportSkeletons(exported, place.kind == ExportPlace::Kind::kShards);
  CellFiles files(exported, formatNamed(exported.format));
  place.kind == ExportPlace::Kind::kZip ? exportZip(files, exported) : exportFolder(files, exported);
  return files.samples();
}

}  // namespace filiform::tools
