#include "index/input/input.h"

#include "index/cell/internal/unit_check.h"
#include "index/errors.h"
#include "index/input/internal/archive.h"
#include "index/input/internal/folder_walk.h"
#include "index/input/internal/graph_file.h"
#include "index/text.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <list>
#include <map>
#include <optional>
#include <system_error>

namespace filiform {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kNoEntry = UINT32_MAX;
constexpr std::size_t kOpenArchives = 8;
constexpr std::uint64_t kBytesOfGraphByte = 8;  // nodes and links, while the graph is read and handed on
constexpr std::uint64_t kBytesOfInput = 1024;   // of a listed file or entry, without names

struct ListedFile {
  std::string path;
  std::string shown;            // path below the argument
  std::string unreadable = {};  // why it cannot be read
  // For a graph:
  std::optional<GraphFormat> format = {};
  std::shared_ptr<const SkeletonInfo> skeleton = {};
};

bool holdsCells(std::string_view file_name) {
  return endsWithNoCase(file_name, ".swc") || endsWithNoCase(file_name, ".zip");
}

bool isSkeletonId(std::string_view file_name) {
  return file_name.find_first_not_of("0123456789") == std::string_view::npos;
}

std::vector<ListedFile> listFolder(const std::string& folder) {
  std::vector<ListedFile> files;
  for (internal::WalkedFile& f : internal::walkFolder(folder, holdsCells))
    files.push_back({std::move(f.path), std::move(f.shown), std::move(f.unreadable)});
  return files;
}

// The files of a folder of Neuroglancer skeletons, by id as text; empty for another folder.
std::vector<ListedFile> listSkeletons(const std::string& folder) {
  const std::string info_path = (fs::path(folder) / "info").native();
  std::error_code error;
  if (!fs::is_regular_file(info_path, error) || fs::file_size(info_path, error) > SkeletonInfo::kMaxBytes || error)
    return {};
  std::ifstream in(info_path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (!SkeletonInfo::isSkeletonInfo(text)) return {};
  const auto info = std::make_shared<const SkeletonInfo>(SkeletonInfo::parse(text, info_path));
  std::vector<ListedFile> files;
  for (internal::WalkedFile& f : internal::walkFolder(folder, isSkeletonId, internal::WalkDepth::folder_only))
    files.push_back(
        {std::move(f.path), std::move(f.shown), std::move(f.unreadable), GraphFormat::kNeuroglancerSkeleton, info});
  if (files.empty()) throw InputError(escaped(folder) + ": its info is that of skeletons, but it holds none");
  return files;
}

InputReport unreadable(const std::string& reason) {
  InputReport report;
  report.severity = Severity::kRefuse;
  report.codes.add(InputCode::E_UNREADABLE);
  report.records.add({0, InputCode::E_UNREADABLE, Effect::kInputRefused, escaped(reason, 300)});
  return report;
}

bool isUnreadable(const InputReport& report) { return report.codes[InputCode::E_UNREADABLE] > 0; }

}  // namespace

struct Input::State {
  struct Item {
    std::string source;
    std::uint32_t row = 0;
    std::uint32_t entry = kNoEntry;  // in the archive's entries()
    std::optional<std::uint64_t> digest;
    bool refused = false;
  };

  explicit State(InputOptions input_options) : options(std::move(input_options)), reader(options.swc) {}

  void list(const std::string& argument);
  void addFile(const ListedFile& file);
  SourceReport& addRow(const ListedFile& file, std::uint64_t bytes);
  void refuse(const ListedFile& file, const IoError& failure);
  void orderEqualSources();
  InputReport readOrRefuse(Item& item, Cell& cell);
  InputReport read(Item& item, Cell& cell);
  InputReport readEntry(Item& item, Cell& cell);
  Archive& openArchive(std::uint32_t row);
  void advance(std::uint64_t bytes);
  void refuseLargeCell(const Item& item, double part_read) const;
  void refuseBeyondMemory(const Item& item, std::uint64_t cell_bytes) const;
  void record(const Item& item, std::uint64_t digest, InputReport report);
  void sumArchives();

  InputOptions options;
  SwcReader reader;
  std::vector<ListedFile> files;  // by row
  std::vector<SourceReport> rows;
  std::map<std::uint32_t, Archive> archives;  // by row
  std::list<std::uint32_t> recently_read;     // rows of archives whose files are open
  std::vector<Item> items;
  std::size_t position = 0, ordered = 0;
  bool complete = false, progress_threw = false;
  std::uint64_t bytes_total = 0, bytes_done = 0;
  UnitCheck units;
};

void Input::State::list(const std::string& argument) {
  std::error_code error;
  const fs::file_status status = fs::status(argument, error);
  if (status.type() == fs::file_type::not_found) throw IoError(escaped(argument), "no such file or folder");
  const std::string name = fs::path(argument).filename().native();
  if (error) {
    refuse({argument, name}, IoError(escaped(argument), "cannot read", error.value()));
  } else if (fs::is_directory(status)) {
    std::vector<ListedFile> found = listSkeletons(argument);
    if (found.empty()) found = listFolder(argument);
    if (found.empty()) throw InputError(escaped(argument) + ": no .swc or .zip file in this folder");
    for (const ListedFile& file : found) addFile(file);
  } else if (fs::is_regular_file(status)) {
    addFile({argument, name, {}, graphFormatOf(argument)});
  } else {
    throw IoError(escaped(argument), "neither a file nor a folder");
  }
}

// Adds a row for an unreadable input. Rethrows the failure if the process is at fault.
void Input::State::refuse(const ListedFile& file, const IoError& failure) {
  if (failure.isShortage()) throw failure;
  addRow(file, {}).report = unreadable(failure.reason());
}

SourceReport& Input::State::addRow(const ListedFile& file, std::uint64_t bytes) {
  SourceReport report;
  report.file = file.shown;
  report.archive = endsWithNoCase(file.path, ".zip");
  report.bytes = bytes;
  bytes_total += bytes;
  files.push_back(file);
  return rows.emplace_back(std::move(report));
}

void Input::State::addFile(const ListedFile& file) {
  const auto row = static_cast<std::uint32_t>(rows.size());
  try {
    if (!file.unreadable.empty()) throw IoError(escaped(file.path), file.unreadable);
    if (endsWithNoCase(file.path, ".zip")) {
      Archive archive(file.path);
      addRow(file, archive.file_bytes()).digest = archive.digest();
      std::uint32_t number = 0;
      for (const ArchiveEntry& entry : archive.entries()) {
        if (!entry.skipped) items.push_back({file.shown + "/" + entry.shown_label(), row, number, std::nullopt, false});
        ++number;
      }
      archives.try_emplace(row, std::move(archive));
    } else {
      std::error_code error;
      const std::uint64_t bytes = fs::file_size(file.path, error);
      if (error) throw IoError(escaped(file.path), "cannot read", error.value());
      addRow(file, bytes);
      items.push_back({file.shown, row, kNoEntry, std::nullopt, false});
    }
  } catch (const IoError& failure) {
    refuse(file, failure);
  }
}

Archive& Input::State::openArchive(std::uint32_t row) {
  recently_read.remove(row);
  recently_read.push_front(row);
  if (recently_read.size() > kOpenArchives) {
    archives.at(recently_read.back()).close();
    recently_read.pop_back();
  }
  return archives.at(row);
}

void Input::State::advance(std::uint64_t bytes) {
  bytes_done += bytes;
  if (!options.progress) return;
  progress_threw = true;
  options.progress(std::min(bytes_done, bytes_total), bytes_total);
  progress_threw = false;
}

// Throws if the cell exceeds the memory for one cell. `part_read`: fraction of its bytes read so far.
void Input::State::refuseLargeCell(const Item& item, double part_read) const {
  if (static_cast<double>(reader.held_bytes()) <= options.cell_share * static_cast<double>(options.memory)) return;
  refuseBeyondMemory(item, reader.held_bytes(1 / std::clamp(part_read, 1e-6, 1.0)));
}

void Input::State::refuseBeyondMemory(const Item& item, std::uint64_t cell_bytes) const {
  const double wanted = static_cast<double>(cell_bytes) / options.cell_share;
  if (wanted <= static_cast<double>(options.memory)) return;
  throw InputError(escaped(item.source) + ": one cell of this size takes more memory than is given; use --memory " +
                   std::to_string((static_cast<std::uint64_t>(wanted) >> 20) + 1) + "MiB");
}

// Equal sources are ordered by digest, which needs an extra read; they are rare.
void Input::State::orderEqualSources() {
  if (position < ordered) return;
  ordered = position + 1;
  while (ordered < items.size() && items[ordered].source == items[position].source) ++ordered;
  if (ordered == position + 1) return;
  const std::uint64_t done = bytes_done;
  Cell cell;
  for (std::size_t i = position; i < ordered; ++i) {
    const InputReport report = readOrRefuse(items[i], cell);
    if (!isUnreadable(report)) items[i].digest = cell.digest;
    bytes_done = done;
  }
  std::stable_sort(items.begin() + static_cast<std::ptrdiff_t>(position),
                   items.begin() + static_cast<std::ptrdiff_t>(ordered),
                   [](const Item& a, const Item& b) { return a.digest < b.digest; });
}

// The first pass refuses a file that cannot be read. Later passes must give the same cells, so they throw.
InputReport Input::State::readOrRefuse(Item& item, Cell& cell) {
  InputReport report;
  try {
    report = read(item, cell);
  } catch (const IoError& failure) {
    if (complete || progress_threw || failure.isShortage()) throw;
    reader.discard();
    cell.clearSamples();
    cell.digest = 0;
    return unreadable(failure.reason());
  }
  if (item.digest && *item.digest != cell.digest) {
    throw IoError(escaped(item.source), "changed while it was being read; run again");
  }
  return report;
}

InputReport Input::State::readEntry(Item& item, Cell& cell) {
  Archive& archive = openArchive(item.row);
  const ArchiveEntry& entry = archive.entries()[item.entry];
  reader.discard();
  std::uint64_t fed = 0;
  const std::optional<InputCode> refusal = archive.read(entry, [&](std::string_view bytes) {
    reader.feed(bytes);
    fed += bytes.size();
    refuseLargeCell(item, static_cast<double>(fed) / static_cast<double>(entry.bytes));
  });
  InputReport report;
  if (refusal) {
    reader.discard();
    cell.clearSamples();
    cell.digest = 0;
    report.codes.add(*refusal);
    report.records.add({0, *refusal, Effect::kInputRefused, {}});
    report.severity = Severity::kRefuse;
  } else {
    report = reader.finish(item.source, cell);
  }
  for (const InputCode code : entry.remarks) {
    report.codes.add(code);
    report.records.addFirst({0, code, Effect::kRemark, {}});
    if (report.severity == Severity::kAccept) report.severity = Severity::kWarn;
  }
  if (options.swc.strict && !entry.remarks.empty()) {
    cell.clearSamples();
    report.severity = Severity::kRefuse;
    report.samples = report.segments = report.isolated = report.roots = 0;
  }
  advance(entry.packed_bytes);
  return report;
}

InputReport Input::State::read(Item& item, Cell& cell) {
  const ListedFile& file = files[item.row];
  std::uint64_t fed = 0;
  const auto progress = [&](std::uint64_t bytes) {
    advance(bytes);
    fed += bytes;
    if (!file.format) refuseLargeCell(item, static_cast<double>(fed) / static_cast<double>(rows[item.row].bytes));
  };
  InputReport report;
  if (item.entry != kNoEntry) {
    report = readEntry(item, cell);
  } else if (file.format) {
    refuseBeyondMemory(item, rows[item.row].bytes * kBytesOfGraphByte);
    GraphOptions graph{options.swc, {}};
    if (file.skeleton) graph.skeleton = *file.skeleton;
    report = readGraphFile(file.path, *file.format, graph, cell, progress);
  } else {
    report = readSwcFile(file.path, reader, cell, progress);
  }
  return report;
}

void Input::State::record(const Item& item, std::uint64_t digest, InputReport report) {
  SourceReport& row = rows[item.row];
  if (item.entry == kNoEntry) {
    row.digest = digest;
    row.report = std::move(report);
    return;
  }
  EntryReport& entry = row.entries[item.entry];
  entry.digest = digest;
  entry.dropped = report.severity == Severity::kRefuse;
  entry.report = std::move(report);
}

void Input::State::sumArchives() {
  for (const auto& [number, archive] : archives) {
    SourceReport& row = rows[number];
    InputReport& sum = row.report;
    sum = {};
    bool any_kept = false;
    for (const EntryReport& entry : row.entries) {
      const InputReport& part = entry.report;
      any_kept = any_kept || !entry.dropped;
      sum.samples += part.samples;
      sum.segments += part.segments;
      sum.isolated += part.isolated;
      sum.roots += part.roots;
      sum.candidate_lines += part.candidate_lines;
      sum.dropped_lines += part.dropped_lines;
      sum.links_given += part.links_given;
      sum.links_cut += part.links_cut;
      sum.codes.add(part.codes);
    }
    if (archive.refusal()) {
      sum.codes.add(*archive.refusal());
      sum.records.add({0, *archive.refusal(), Effect::kInputRefused, {}});
    }
    const bool refuse = !any_kept || (options.swc.strict && !sum.codes.empty());
    sum.severity = refuse ? Severity::kRefuse : sum.codes.empty() ? Severity::kAccept : Severity::kWarn;
  }
}

Input::Input(const std::vector<std::string>& arguments, InputOptions options)
    : state_(std::make_unique<State>(std::move(options))) {
  if (arguments.empty()) throw InputError("no input: name .swc files, .zip archives or folders");
  for (const std::string& argument : arguments) state_->list(argument);
  std::stable_sort(state_->items.begin(), state_->items.end(),
                   [](const State::Item& a, const State::Item& b) { return a.source < b.source; });
  rewind();
}

Input::~Input() = default;
Input::Input(Input&&) noexcept = default;
Input& Input::operator=(Input&&) noexcept = default;

bool Input::next(Cell& cell) {
  State& state = *state_;
  while (state.position < state.items.size()) {
    if (!state.complete) state.orderEqualSources();
    State::Item& item = state.items[state.position];
    if (item.refused) {
      ++state.position;
      continue;
    }
    InputReport report = state.readOrRefuse(item, cell);
    ++state.position;
    item.digest.reset();
    if (!isUnreadable(report)) item.digest = cell.digest;
    const bool refused = report.severity == Severity::kRefuse;
    if (!state.complete) {
      state.record(item, cell.digest, std::move(report));
      item.refused = refused;
    }
    if (refused) continue;
    cell.source = item.source;
    if (!state.complete) state.units.add(cell);
    return true;
  }
  if (!state.complete) {
    state.sumArchives();
    state.complete = true;
  }
  for (const std::uint32_t row : state.recently_read) state.archives.at(row).close();
  state.recently_read.clear();
  state.bytes_done = state.bytes_total;
  state.advance(0);
  return false;
}

void Input::rewind() {
  State& state = *state_;
  state.position = 0;
  state.bytes_done = 0;
  if (state.complete) return;
  state.units = {};
  for (State::Item& item : state.items) item.refused = false;
  for (const auto& [number, archive] : state.archives) {
    std::vector<EntryReport>& entries = state.rows[number].entries;
    entries.clear();
    entries.reserve(archive.entries().size());
    for (const ArchiveEntry& entry : archive.entries()) {
      EntryReport report{entry.name, entry.bytes, 0, entry.skipped, {}};
      if (entry.skipped) {
        report.report.severity = Severity::kWarn;
        for (const InputCode code : entry.remarks) {
          report.report.codes.add(code);
          report.report.records.add({0, code, Effect::kInputRefused, {}});
        }
      }
      entries.push_back(std::move(report));
    }
  }
}

const std::vector<SourceReport>& Input::reports() const { return state_->rows; }
std::uint64_t Input::listed() const { return state_->items.size(); }
std::vector<std::string_view> Input::sources() const {
  std::vector<std::string_view> sources;
  sources.reserve(state_->items.size());
  for (const State::Item& item : state_->items) sources.push_back(item.source);
  return sources;
}
std::uint64_t Input::held_bytes() const {
  std::uint64_t bytes = (state_->items.size() + state_->rows.size()) * kBytesOfInput;
  for (const State::Item& item : state_->items) bytes += 4 * item.source.size();
  return bytes;
}
std::string Input::unitDoubt() const {
  const SwcOptions& swc = state_->options.swc;
  return state_->units.doubt(swc.voxel_um ? std::cbrt(swc.voxel_um->prod()) : swc.unit_um);
}
std::uint64_t Input::bytes() const { return state_->bytes_total; }

}  // namespace filiform
