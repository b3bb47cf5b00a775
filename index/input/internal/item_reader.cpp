#include "index/input/internal/item_reader.h"

#include "index/containers/internal/gunzip.h"
#include "index/errors.h"
#include "index/file/internal/file_parts.h"
#include "index/formats/internal/h5_morphology.h"
#include "index/text.h"

#include <algorithm>
#include <array>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kBytesOfSectionPoint = 320;  // of a section, while it is read and handed on
constexpr std::uint64_t kBytesOfGraphByte = 8;       // nodes and links, while the graph is read and handed on

// As programs that copy from an object store leave it: gzip data without the ending.
bool isGzipSkeleton(const InputItem& item) {
  std::array<char, 8> head{};
  if (item.bytes < head.size()) return false;
  FileParts(*item.path, item.bytes).read(0, head);
  return item.skeleton->isGzip({head.data(), head.size()}, item.bytes);
}

}  // namespace

ItemReader::ItemReader(const SwcOptions& options, const Limits& limits)
    : options_(options), limits_(limits), reader_(options) {}

Container::Reader& ItemReader::readerOf(const Container& container) {
  const auto found =
      std::find_if(open_.begin(), open_.end(), [&](const auto& open) { return open.first == &container; });
  if (!open_.empty() && found != open_.begin()) open_.front().second->release();
  if (found != open_.end()) {
    open_.splice(open_.begin(), open_, found);
  } else {
    if (open_.size() >= limits_.open_archives) open_.pop_back();
    open_.emplace_front(&container, container.reader());
  }
  return *open_.front().second;
}

// Throws if the cell exceeds the memory for one cell. `fed`: bytes of the item read so far.
void ItemReader::refuseLargeCell(const InputItem& item, std::uint64_t fed) const {
  if (static_cast<double>(reader_.held_bytes()) <= limits_.cell_share * static_cast<double>(limits_.memory)) return;
  const double part_read = item.estimated ? 1 : static_cast<double>(fed) / static_cast<double>(item.bytes);
  refuseBeyondMemory(item, reader_.held_bytes(1 / std::clamp(part_read, 1e-6, 1.0)));
}

void ItemReader::refuseBeyondMemory(const InputItem& item, std::uint64_t cell_bytes) const {
  const double wanted = static_cast<double>(cell_bytes) / limits_.cell_share;
  if (wanted <= static_cast<double>(limits_.memory)) return;
  throw InputError(inShort(*item.source) + ": one cell of this size takes more memory than is given; use --memory " +
                   std::to_string((static_cast<std::uint64_t>(wanted) >> 20) + 1) + "MiB");
}

InputReport ItemReader::readContent(
    const InputItem& item, std::optional<GraphFormat> format, const SkeletonInfo* skeleton, Cell& cell,
    const std::function<std::optional<InputCode>(const Container::Reader::Sink&)>& pass) {
  reader_.discard();
  std::uint64_t fed = 0;
  std::string content;  // of a graph
  const std::optional<InputCode> refusal = pass([&](std::string_view bytes) {
    fed += bytes.size();
    if (ahead_ && item.estimated && fed > item.bytes) throw LargerThanEstimated();
    if (format) {
      content += bytes;
      refuseBeyondMemory(item, content.size() * (kBytesOfGraphByte + 2));
    } else {
      reader_.feed(bytes);
      refuseLargeCell(item, fed);
    }
  });
  if (refusal) {
    reader_.discard();
    cell.clearSamples();
    cell.digest = 0;
    InputReport report;
    report.codes.add(*refusal);
    report.records.add({0, *refusal, Effect::kInputRefused, {}});
    report.severity = Severity::kRefuse;
    return report;
  }
  if (!format) return reader_.finish(*item.source, cell);
  GraphOptions graph{options_, {}};
  if (skeleton != nullptr) graph.skeleton = *skeleton;
  return readGraph(content, *item.source, *format, graph, cell);
}

InputReport ItemReader::readPacked(const InputItem& item, Cell& cell,
                                   const std::function<void(std::uint64_t bytes)>& progress) {
  return readContent(item, item.format, item.skeleton, cell,
                     [&](const Container::Reader::Sink& sink) { return gunzipFile(*item.path, sink, progress); });
}

InputReport ItemReader::readEntry(const InputItem& item, Cell& cell,
                                  const std::function<void(std::uint64_t bytes)>& progress) {
  const ArchiveEntry& entry = *item.entry;
  InputReport report =
      readContent(item, entry.format, item.container->skeletons(), cell, [&](const Container::Reader::Sink& sink) {
        return readerOf(*item.container).read(entry, [&](std::string_view bytes) {
          sink(bytes);
          progress(0);
        });
      });
  addRemarks(entry, report, cell);
  progress(entry.packed_bytes);
  return report;
}

// What the name of the entry says.
void ItemReader::addRemarks(const ArchiveEntry& entry, InputReport& report, Cell& cell) const {
  for (const InputCode code : entry.remarks) remark(code, {}, report, cell);
}

// Adds a remark on a whole input, which refuses it if reading is strict.
void ItemReader::remark(InputCode code, std::string_view token, InputReport& report, Cell& cell) const {
  report.codes.add(code);
  report.records.addFirst({0, code, Effect::kRemark, escaped(token, 100)});
  if (report.severity == Severity::kAccept) report.severity = Severity::kWarn;
  if (!options_.strict) return;
  cell.clearSamples();
  report.severity = Severity::kRefuse;
  report.samples = report.segments = report.isolated = report.roots = 0;
}

InputReport ItemReader::readH5(const InputItem& item, Cell& cell,
                               const std::function<void(std::uint64_t bytes)>& progress) {
  const auto check = [&](std::uint64_t points) {
    refuseBeyondMemory(item, points * kBytesOfSectionPoint);
    progress(0);
  };
  const bool inside = item.entry != nullptr && item.entry->file > 0;
  const std::string path = inside ? readerOf(*item.container).h5PathOf(*item.entry) : *item.path;
  InputReport report = readH5Morphology(hdf5_, path, *item.morphology, options_, check, cell);
  if (item.entry != nullptr) addRemarks(*item.entry, report, cell);
  progress(item.entry != nullptr ? item.entry->packed_bytes : item.bytes);
  return report;
}

InputReport ItemReader::read(const InputItem& item, Cell& cell,
                             const std::function<void(std::uint64_t bytes)>& progress, bool ahead) {
  cell.attributes.clear();
  ahead_ = ahead;
  InputReport report = readShape(item, cell, progress);
  if (item.properties == nullptr || report.severity == Severity::kRefuse) return report;
  item.properties->apply(item.object, cell);
  for (const std::string& property : item.properties->leftOut()) remark(InputCode::W_ATTRIBUTE, property, report, cell);
  return report;
}

InputReport ItemReader::readShape(const InputItem& item, Cell& cell,
                                  const std::function<void(std::uint64_t bytes)>& progress) {
  if (item.packed) return readPacked(item, cell, progress);
  if (item.skeleton != nullptr && item.format && item.entry == nullptr && isGzipSkeleton(item)) {
    InputItem packed = item;
    packed.estimated = true;
    return readPacked(packed, cell, progress);
  }
  if (item.morphology != nullptr) return readH5(item, cell, progress);
  if (item.entry != nullptr) return readEntry(item, cell, progress);
  if (item.format) {
    refuseBeyondMemory(item, item.bytes * kBytesOfGraphByte);
    GraphOptions graph{options_, {}};
    if (item.skeleton != nullptr) graph.skeleton = *item.skeleton;
    return readGraphFile(*item.path, *item.format, graph, cell, progress);
  }
  std::uint64_t fed = 0;
  return readSwcFile(*item.path, reader_, cell, [&](std::uint64_t bytes) {
    progress(bytes);
    fed += bytes;
    refuseLargeCell(item, fed);
  });
}

}  // namespace filiform::internal
