#include "index/set/internal/cells_reader.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace filiform::internal {

const CellsReader::Table& CellsReader::table() const {
  return table_.get([this] {
    const Manifest& manifest = revision_.manifest();
    const SetFile& file = revision_.file(kCellsFile);
    const std::string name = revision_.describe(kCellsFile);
    if (manifest.cells_root_bytes > file.bytes)
      throw CorruptSet(revision_.describe(kManifestFile), 0, "the root of the cells is larger than their file");
    const std::uint64_t at = file.bytes - manifest.cells_root_bytes;
    const Bytes bytes =
        revision_.readChecked(kCellsFile, at, manifest.cells_root_bytes, manifest.cells_root_checksum, "the root");
    auto table = std::make_unique<Table>();
    table->root = decoded(name, at, [&] { return decodeCellsRoot(bytes, file.bytes); });
    if (table->root.named != manifest.counts.cells ||
        table->root.cells != manifest.counts.cells + manifest.counts.removed)
      throw CorruptSet(name, at, "contradicts the manifest");
    table->records = std::make_unique<ReadOnce<CellPage>[]>(table->root.records.size());
    table->names = std::make_unique<ReadOnce<NamePage>[]>(table->root.names.size());
    return table;
  });
}

CellPage CellsReader::readRecords(const CellsRoot& root, std::uint32_t page) const {
  const CellPagePlace& at = root.records[page];
  const Bytes bytes =
      revision_.readChecked(kCellsFile, at.offset, at.bytes, at.checksum, "page " + std::to_string(page) + " of cells");
  return decoded(revision_.describe(kCellsFile), at.offset, [&] {
    CellPage found = decodeCellPage(bytes, cellsOfPage(root.cells, page), revision_.file(kCellsFile).bytes);
    const SetCounts& all = revision_.manifest().counts;
    for (const CellRecord& r : found.records)
      if (r.samples > all.samples || r.segments > all.segments || r.isolated > all.isolated || r.roots > all.roots)
        throw Damage{0, "a cell has more samples or segments than the set"};
    return found;
  });
}

NamePage CellsReader::readNames(const CellsRoot& root, std::uint32_t page) const {
  const CellPagePlace& at = root.names[page];
  const Bytes bytes =
      revision_.readChecked(kCellsFile, at.offset, at.bytes, at.checksum, "page " + std::to_string(page) + " of names");
  return decoded(revision_.describe(kCellsFile), at.offset, [&] { return decodeNamePage(root, page, bytes); });
}

const CellPage& CellsReader::page(std::uint32_t id) const {
  const SetCounts& counts = revision_.manifest().counts;
  if (id >= counts.cells + counts.removed) throw std::out_of_range("the cell does not exist");
  const Table& t = table();
  const std::uint32_t number = id / kCellsOfPage;
  return t.records[number].get([&] { return std::make_unique<CellPage>(readRecords(t.root, number)); });
}

const CellRecord& CellsReader::record(std::uint32_t id) const { return page(id).records[id % kCellsOfPage]; }

std::optional<std::uint32_t> CellsReader::find(const std::string& name) const {
  const Table& t = table();
  const auto& firsts = t.root.first_names;
  // The page before the first one that begins with this name or a later one may end with the name.
  auto number = static_cast<std::uint32_t>(std::lower_bound(firsts.begin(), firsts.end(), name) - firsts.begin());
  const std::uint32_t end = number + (number < firsts.size() && firsts[number] == name ? 1 : 0);
  for (number -= number > 0 ? 1 : 0; number < end; ++number) {
    const NamePage& names = t.names[number].get([&] { return std::make_unique<NamePage>(readNames(t.root, number)); });
    const auto found = std::lower_bound(names.begin(), names.end(), std::pair(name, std::uint32_t{0}));
    if (found != names.end() && found->first == name) return found->second;
  }
  return std::nullopt;
}

Bytes CellsReader::encodedDetail(std::uint32_t id) const {
  const DetailPlace& at = page(id).details[id % kCellsOfPage];
  return revision_.readChecked(kCellsFile, at.offset, at.bytes, at.checksum, "cell " + std::to_string(id));
}

template <typename Decode>
auto CellsReader::decodedDetail(std::uint32_t id, Decode decode) const {
  const CellPage& p = page(id);
  const Bytes bytes = encodedDetail(id);
  return decoded(revision_.describe(kCellsFile), p.details[id % kCellsOfPage].offset, [&] {
    auto found = decode(bytes, p.records[id % kCellsOfPage]);
    if (!found) throw Damage{0, "cell " + std::to_string(id) + " contradicts its record"};
    return *std::move(found);
  });
}

CellDetail CellsReader::detail(std::uint32_t id, TileId tile_count) const {
  return decodedDetail(id, [&](ByteSpan bytes, const CellRecord& record) -> std::optional<CellDetail> {
    CellDetail detail = decodeDetail(bytes, record.samples);
    if (detail.roots.size() != record.roots || (!detail.tiles.empty() && detail.tiles.back() >= tile_count)) return {};
    return detail;
  });
}

std::vector<TileId> CellsReader::tiles(std::uint32_t id, TileId tile_count) const {
  return decodedDetail(id, [&](ByteSpan bytes, const CellRecord&) -> std::optional<std::vector<TileId>> {
    std::vector<TileId> tiles = decodeTiles(bytes);
    if (!tiles.empty() && tiles.back() >= tile_count) return {};
    return tiles;
  });
}

void CellsReader::check() const {
  const CellsRoot& root = table().root;
  const SetCounts& stated = revision_.manifest().counts;
  SetCounts sum = stated;
  sum.samples = sum.segments = sum.isolated = sum.roots = sum.removed = 0;
  for (std::uint32_t number = 0; number < root.records.size(); ++number)
    for (const CellRecord& r : readRecords(root, number).records)
      sum.samples += r.samples, sum.segments += r.segments, sum.isolated += r.isolated, sum.roots += r.roots,
          sum.removed += r.removed ? 1 : 0;
  if (sum != stated) throw CorruptSet(revision_.describe(kCellsFile), 0, "contradicts the manifest");
  for (std::uint32_t number = 0; number < root.names.size(); ++number) readNames(root, number);
}

}  // namespace filiform::internal
