#include "index/input/input.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/formats/neuroglancer/object_ids.h"
#include "index/input/internal/archive_report.h"
#include "index/input/internal/input_state.h"
#include "index/text.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <functional>
#include <numeric>
#include <optional>
#include <utility>

namespace filiform {
namespace {

using internal::InputItem;
using internal::isUnreadable;
using internal::ItemReader;
using internal::kNoEntry;
using internal::ListedFile;
using internal::ReadAhead;

const std::string kOnlyMorphology;  // of an H5 file that is no container
constexpr std::size_t kOpenArchivesOfThread = 2;
constexpr std::uint64_t kBytesOfInput = 1024;       // of a listed file or entry, without names
constexpr std::uint64_t kGuessOfRatio = 8;          // content of packed bytes whose size is not stated
constexpr std::uint64_t kGuessOfObject = 1 << 20;   // content of an object at an address
constexpr unsigned kThreadsForServers = 16;         // mostly waiting
constexpr std::uint64_t kBytesOfByte = 9;           // most memory for each byte of an input while it is read
constexpr std::uint64_t kBytesOfReader = 16 << 20;  // arrays that a thread keeps
constexpr std::uint64_t kMostReadAhead = 256 << 20;

// Ends the reading of an input; the reason is kept elsewhere.
struct ReadingStopped {};

}  // namespace

void internal::InputState::advance(std::uint64_t bytes) {
  bytes_done += bytes;
  if (options.progress) options.progress(std::min(bytes_done, bytes_total), bytes_total);
}

// Equal sources are ordered by digest, which needs an extra read; they are rare.
void internal::InputState::orderEqualSources() {
  if (position < ordered) return;
  ordered = position + 1;
  while (ordered < items.size() && items[ordered].source == items[position].source) ++ordered;
  if (ordered == position + 1) return;
  const std::uint64_t done = bytes_done;
  Cell cell;
  for (std::size_t i = position; i < ordered; ++i) {
    const InputReport report = readHere(items[i], cell);
    if (!isUnreadable(report)) items[i].digest = cell.digest;
    bytes_done = done;
  }
  std::stable_sort(items.begin() + static_cast<std::ptrdiff_t>(position),
                   items.begin() + static_cast<std::ptrdiff_t>(ordered),
                   [](const Item& a, const Item& b) { return a.digest < b.digest; });
}

InputItem internal::InputState::inputItem(const Item& item) const {
  const ListedFile& file = files[item.row];
  InputItem input;
  input.source = &item.source;
  input.path = &file.path;
  input.bytes = rows[item.row].bytes;
  input.format = file.format;
  input.skeleton = file.skeleton.get();
  input.properties = file.properties.get();
  if (file.properties) {
    const std::string& name = item.entry == kNoEntry ? file.shown : containers.at(item.row)->entries()[item.entry].name;
    readObjectId(std::string_view(name).substr(0, name.find('.')), input.object);
  }
  input.packed = file.packed;
  if (file.packed) {
    input.estimated = true;
    input.bytes = content_bytes[item.row] > 0 ? content_bytes[item.row] : input.bytes * kGuessOfRatio;
  }
  if (item.entry == kNoEntry) {
    if (file.kind == internal::FileKind::h5) input.morphology = &kOnlyMorphology;
  } else {
    input.container = containers.at(item.row).get();
    input.entry = &input.container->entries()[item.entry];
    if (input.entry->kind == internal::FileKind::h5) input.morphology = &input.entry->morphology;
    input.bytes = input.entry->bytes;
    input.estimated = input.bytes == 0 && (input.entry->packed_bytes > 0 || file.skeleton_files);
    if (input.estimated) input.bytes = std::max(input.entry->packed_bytes * kGuessOfRatio, kGuessOfObject);
  }
  return input;
}

std::unique_ptr<ItemReader> internal::InputState::makeReader(std::size_t open_archives) const {
  return std::make_unique<ItemReader>(
      options.swc, ItemReader::Limits{options.memory, options.cell_share, std::max<std::size_t>(open_archives, 1)});
}

// The first pass refuses a file that cannot be read. Later passes must give the same cells, so they throw.
InputReport internal::InputState::readOrRefuse(ItemReader& reader, const Item& item, Cell& cell,
                                               const std::function<void(std::uint64_t)>& on_bytes,
                                               bool is_ahead) const {
  try {
    return reader.read(inputItem(item), cell, on_bytes, is_ahead);
  } catch (const IoError& failure) {
    if (complete || failure.isShortage()) throw;
    cell.clearSamples();
    cell.digest = 0;
    return unreadableFor(failure.reason());
  }
}

void internal::InputState::checkUnchanged(const Item& item, const InputReport& report, const Cell& cell) const {
  if (item.digest && !isUnreadable(report) && *item.digest != cell.digest)
    throw IoError(inShort(item.source), "changed while it was being read; run again");
}

InputReport internal::InputState::readHere(Item& item, Cell& cell) {
  std::exception_ptr thrown;
  InputReport report;
  try {
    report = readOrRefuse(*readers.front(), item, cell, [&](std::uint64_t bytes) {
      try {
        advance(bytes);
      } catch (...) {
        thrown = std::current_exception();
        throw ReadingStopped();  // an IoError of the caller is not one of the file
      }
    });
  } catch (const ReadingStopped&) {
    std::rethrow_exception(thrown);
  }
  checkUnchanged(item, report, cell);
  return report;
}

InputReport internal::InputState::takeAhead(Item& item, Cell& cell) {
  ReadAhead::Result result;
  std::swap(result.cell, cell);
  ahead->take(static_cast<std::size_t>(&item - items.data()), result, [this] { advance(0); });
  std::swap(result.cell, cell);
  try {
    if (result.failure) std::rethrow_exception(result.failure);
  } catch (const internal::LargerThanEstimated&) {
    return readHere(item, cell);
  }
  advance(result.bytes);
  checkUnchanged(item, result.report, cell);
  return std::move(result.report);
}

// Memory of the inputs that are read ahead.
std::uint64_t internal::InputState::bytesAhead() const {
  const double share = options.cell_share / 2 * static_cast<double>(options.memory);
  return static_cast<std::uint64_t>(std::min<double>(share, kMostReadAhead));
}

// Memory that a further thread takes for open archives.
std::uint64_t internal::InputState::bytesOfThread() const {
  std::vector<std::uint64_t> bytes;
  for (const auto& [row, container] : containers) bytes.push_back(container->reader_bytes());
  const auto open = static_cast<std::ptrdiff_t>(std::min(bytes.size(), kOpenArchivesOfThread));
  std::partial_sort(bytes.begin(), bytes.begin() + open, bytes.end(), std::greater<>());
  return std::accumulate(bytes.begin(), bytes.begin() + open, std::uint64_t{0});
}

unsigned internal::InputState::readingThreads() const {
  const std::uint64_t most = bytesAhead() / (kBytesOfReader + bytesOfThread());
  const bool from_server = std::any_of(files.begin(), files.end(), [](const ListedFile& file) {
    return file.kind == internal::FileKind::objects || file.path.find("://") != std::string::npos;
  });
  const unsigned wanted = from_server ? std::max(options.threads, kThreadsForServers) : options.threads;
  return static_cast<unsigned>(std::clamp<std::uint64_t>(wanted, 1, std::max<std::uint64_t>(most, 1)));
}

// Inputs of equal source are read alone, since their order follows from their content.
std::vector<std::uint64_t> internal::InputState::costsAhead() const {
  const std::uint64_t most = bytesAhead() / kBytesOfByte;
  std::vector<std::uint64_t> costs(items.size(), ReadAhead::kSkip);
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (items[i].refused || i < begin_at || i >= end()) continue;
    const std::uint64_t bytes = inputItem(items[i]).bytes;
    const bool twin = (i > 0 && items[i].source == items[i - 1].source) ||
                      (i + 1 < items.size() && items[i].source == items[i + 1].source);
    costs[i] = twin || bytes > most ? ReadAhead::kAlone : bytes * kBytesOfByte;
  }
  return costs;
}

void internal::InputState::startReadingAhead() {
  const unsigned threads = readingThreads();
  if (threads == 1 || ahead) return;
  while (readers.size() < threads) readers.push_back(makeReader(kOpenArchivesOfThread));
  const auto read = [this](unsigned reader, std::size_t item, const std::atomic<bool>& stop,
                           ReadAhead::Result& result) {
    result.report = readOrRefuse(
        *readers[reader], items[item], result.cell,
        [&](std::uint64_t bytes) {
          if (stop) throw ReadingStopped();
          result.bytes += bytes;
        },
        true);
  };
  ahead = std::make_unique<ReadAhead>(ReadAhead::Plan{threads, bytesAhead(), costsAhead(), read});
}

void internal::InputState::record(const Item& item, std::uint64_t digest, InputReport report) {
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

void internal::InputState::sumContainers() {
  for (const auto& [row, container] : containers)
    if (container->refusal() || !container->entries().empty())
      internal::sumEntries(*container, options.swc.strict, rows[row]);
}

void internal::InputState::begin() {
  hdf5.stop();
  std::stable_sort(items.begin(), items.end(), [](const Item& a, const Item& b) { return a.source < b.source; });
}

Input::Input(const std::vector<std::string>& arguments, InputOptions options)
    : state_(std::make_unique<State>(std::move(options))) {
  if (arguments.empty()) throw InputError("no input: name files of neurons, archives or folders");
  for (const std::string& argument : arguments) state_->list(argument);
  const InputOptions& given = state_->options;
  const auto isSkeleton = [](const ListedFile& file) { return file.skeleton != nullptr; };
  if ((given.ids || !given.where.empty() || given.box_um) &&
      std::none_of(state_->files.begin(), state_->files.end(), isSkeleton))
    throw UsageError("--ids, --where and --box choose among precomputed skeletons, and no INPUT holds any");
  state_->begin();
  rewind();
}

Input::Input(std::span<const InputFile> files, InputOptions options)
    : state_(std::make_unique<State>(std::move(options))) {
  for (const InputFile& file : files) {
    ListedFile listed = internal::fileArgument(file.path, file.shown);
    listed.only = file.only;
    state_->addFile(listed);
  }
  state_->begin();
  rewind();
}

Input::~Input() = default;
Input::Input(Input&&) noexcept = default;
Input& Input::operator=(Input&&) noexcept = default;

bool Input::next(Cell& cell) {
  State& state = *state_;
  if (!state.parts.empty()) {
    cell = std::move(state.parts.back());
    state.parts.pop_back();
    cell.source = state.whole.source;
    cell.digest = state.whole.digest;
    cell.header = state.whole.header;
    cell.attributes = state.whole.attributes;
    return true;
  }
  while (state.position < state.end()) {
    if (!state.complete) state.orderEqualSources();
    State::Item& item = state.items[state.position];
    if (item.refused) {
      ++state.position;
      continue;
    }
    state.startReadingAhead();
    const bool is_ahead = state.ahead && state.ahead->isAhead(state.position);
    InputReport report = is_ahead ? state.takeAhead(item, cell) : state.readHere(item, cell);
    ++state.position;
    item.digest.reset();
    if (!isUnreadable(report)) item.digest = cell.digest;
    const bool refused = report.severity == Severity::kRefuse;
    cell.source = item.source;
    if (!refused && !state.options.one_cell_a_file) {
      CellParts parts = cellPartsOf(cell);
      if (parts.loose_trees > 0 && !state.complete) {
        report.codes.add(InputCode::LOOSE_TREE);
        report.records.addFirst({.code = InputCode::LOOSE_TREE, .token = counted(parts.loose_trees, "tree")});
      }
      state.parts = std::move(parts.cells);
      std::reverse(state.parts.begin(), state.parts.end());
    }
    report.cells = refused ? 0 : std::max<std::size_t>(state.parts.size(), 1);
    if (!state.complete) {
      state.record(item, cell.digest, std::move(report));
      item.refused = refused;
    }
    if (refused) continue;
    if (!state.complete) state.units.add(cell);
    if (state.parts.empty()) return true;
    state.whole = {};
    state.whole.source = std::move(cell.source);
    state.whole.digest = cell.digest;
    state.whole.header = std::move(cell.header);
    state.whole.attributes = std::move(cell.attributes);
    return next(cell);
  }
  if (!state.complete) {
    state.sumContainers();
    state.complete = true;
  }
  state.ahead.reset();
  for (const auto& reader : state.readers) reader->close();
  state.bytes_done = state.bytes_total;
  state.advance(0);
  return false;
}

void Input::keepFilesWhole() { state_->options.one_cell_a_file = true; }

void Input::rewind() {
  State& state = *state_;
  state.parts.clear();
  state.ahead.reset();
  state.position = state.begin_at;
  state.ordered = 0;
  state.bytes_done = 0;
  if (state.complete) return;
  state.units = {};
  for (State::Item& item : state.items) item.refused = false;
  for (const auto& [row, container] : state.containers) internal::listEntries(*container, state.rows[row]);
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
  const SegmentProperties* last = nullptr;  // the files of one source follow each other
  for (const ListedFile& file : state_->files) {
    if (file.properties && file.properties.get() != last) bytes += file.properties->held_bytes();
    last = file.properties.get();
  }
  return bytes;
}
std::uint64_t Input::reading_bytes() const { return (state_->readingThreads() - 1) * state_->bytesOfThread(); }
std::string Input::unitDoubt() const {
  const SwcOptions& swc = state_->options.swc;
  return state_->units.doubt(swc.voxel_um ? std::cbrt(swc.voxel_um->prod()) : swc.unit_um);
}
std::uint64_t Input::bytes() const { return state_->bytes_total; }

}  // namespace filiform
