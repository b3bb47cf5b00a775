#include "index/set/internal/cells_file.h"

#include "index/file/internal/digest.h"

#include <algorithm>

namespace filiform::internal {
namespace {

constexpr std::string_view kCellsMagic = "FILICELL";

}  // namespace

Bytes encodeDetail(const CellDetail& detail) {
  ByteWriter out;
  out.varint(detail.tiles.size());
  std::uint32_t tile = 0;
  for (TileId t : detail.tiles) out.varint(t - tile), tile = t;
  const std::vector<std::int64_t>& ids = detail.sample_ids;
  const auto runEnd = [&ids](std::size_t begin) {  // ids that increase by one
    std::size_t end = begin + 1;
    while (end < ids.size() && ids[end - 1] != INT64_MAX && ids[end] == ids[end - 1] + 1) ++end;
    return end;
  };
  std::size_t runs = 0;
  for (std::size_t i = 0; i < ids.size(); i = runEnd(i)) ++runs;
  out.varint(runs);
  std::uint64_t id = 0;
  for (std::size_t begin = 0, end = 0; begin < ids.size(); begin = end) {
    end = runEnd(begin);
    // Modulo 2^64: any two ids have a difference.
    const auto first = static_cast<std::uint64_t>(ids[begin]);
    out.varint(zigzag(static_cast<std::int64_t>(first - id)));
    out.varint(end - begin - 1);
    id = first + (end - begin);
  }
  out.varint(detail.roots.size());
  std::uint32_t rank = 0;
  for (const CellDetail::Root& root : detail.roots) {
    out.varint(root.rank - rank);
    out.f32(root.radius_um);
    out.u16(root.type);
    rank = root.rank;
  }
  out.varint(detail.block_starts.size());
  rank = 0;
  for (std::uint32_t start : detail.block_starts) out.varint(start - rank), rank = start;
  return out.take();
}

CellDetail decodeDetail(ByteSpan bytes, std::uint64_t samples) {
  ByteReader in(bytes);
  CellDetail detail;
  const auto ascending = [&](std::uint64_t& value, bool first, std::uint64_t limit) {
    const std::uint64_t step = in.varint();
    in.require((first || step > 0) && step < limit && value + step < limit, "a list is out of order");
    return static_cast<std::uint32_t>(value += step);
  };
  std::uint64_t at = 0;
  const std::uint32_t tiles = in.varint32();
  for (std::uint32_t i = 0; i < tiles; ++i) detail.tiles.push_back(ascending(at, i == 0, kNoTile));
  const std::uint32_t runs = in.varint32();
  std::uint64_t id = 0;
  for (std::uint32_t i = 0; i < runs; ++i) {
    id += static_cast<std::uint64_t>(unzigzag(in.varint()));
    const std::uint64_t count = std::uint64_t{in.varint32()} + 1;
    in.require(count <= samples - detail.sample_ids.size(), "more sample ids than samples");
    for (std::uint64_t k = 0; k < count; ++k) detail.sample_ids.push_back(static_cast<std::int64_t>(id++));
  }
  in.require(detail.sample_ids.size() == samples, "sample ids are missing");
  const std::uint32_t roots = in.varint32();
  at = 0;
  for (std::uint32_t i = 0; i < roots; ++i) {
    const std::uint32_t rank = ascending(at, i == 0, samples);
    const float radius_um = in.f32();
    detail.roots.push_back({rank, radius_um, in.u16()});
  }
  const std::uint32_t blocks = in.varint32();
  at = 0;
  for (std::uint32_t i = 0; i < blocks; ++i) detail.block_starts.push_back(ascending(at, i == 0, samples));
  in.require(in.left() == 0, "bytes beyond the end of the cell");
  return detail;
}

Bytes encodeCellTable(const std::vector<CellRecord>& records, const std::vector<std::uint64_t>& digests,
                      const std::vector<DetailPlace>& places) {
  const auto n = static_cast<std::uint32_t>(records.size());
  std::string strings;
  std::vector<std::uint64_t> string_at;
  for (const CellRecord& record : records) {
    string_at.push_back(strings.size());
    strings += record.name + record.source;
  }
  const std::uint64_t details_at = kCellsHeaderBytes + std::uint64_t{n} * (kCellRecordBytes + 4) + strings.size();
  ByteWriter table, index;
  for (std::uint32_t i = 0; i < n; ++i) {
    const CellRecord& record = records[i];
    table.u64(string_at[i]);
    table.u32(static_cast<std::uint32_t>(record.name.size()));
    table.u32(static_cast<std::uint32_t>(record.source.size()));
    table.u64(digests[i]);
    table.u64(record.samples);
    table.u64(record.segments);
    table.u64(record.isolated);
    table.u64(record.roots);
    table.box(record.bounds);
    table.u64(details_at + places[i].offset);
    table.u64(places[i].bytes);
    table.u64(places[i].checksum);
  }
  std::vector<std::uint32_t> order(n);
  for (std::uint32_t i = 0; i < n; ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return records[a].name != records[b].name ? records[a].name < records[b].name : a < b;
  });
  for (std::uint32_t i : order) index.u32(i);
  ByteWriter out;
  writeMagic(out, kCellsMagic);
  out.u32(n);
  out.u64(checksum(table.bytes()));
  out.u64(checksum(index.bytes()));
  out.u64(strings.size());
  out.u64(checksum(strings));
  out.u64(checksum(out.bytes()));
  out.append(table.bytes());
  out.append(index.bytes());
  out.text(strings);
  return out.take();
}

std::uint64_t cellTableBytes(ByteSpan header, std::uint64_t file_bytes) {
  ByteReader in(header);
  checkMagic(in, kCellsMagic);
  const std::uint32_t n = in.u32();
  in.u64();
  in.u64();
  const std::uint64_t strings = in.u64();
  in.u64();
  const std::uint64_t stated = in.u64();
  if (checksum(header.first(kCellsHeaderBytes - 8)) != stated) throw Damage{0, "the header's checksum is wrong"};
  const std::uint64_t fixed = kCellsHeaderBytes + std::uint64_t{n} * (kCellRecordBytes + 4);
  in.require(fixed <= file_bytes && strings <= file_bytes - fixed, "more cells than there are bytes");
  return fixed + strings;
}

CellTable decodeCells(ByteSpan bytes) {
  cellTableBytes(bytes.first(std::min(bytes.size(), kCellsHeaderBytes)), bytes.size());
  ByteReader in(bytes);
  in.take(12);
  const std::uint32_t n = in.u32();
  const std::uint64_t records_checksum = in.u64(), index_checksum = in.u64(), string_bytes = in.u64(),
                      strings_checksum = in.u64();
  in.u64();
  const ByteSpan records = in.take(std::uint64_t{n} * kCellRecordBytes);
  const ByteSpan index = in.take(std::uint64_t{n} * 4);
  const ByteSpan strings = in.take(string_bytes);
  if (checksum(records) != records_checksum) throw Damage{kCellsHeaderBytes, "the records' checksum is wrong"};
  if (checksum(index) != index_checksum)
    throw Damage{kCellsHeaderBytes + records.size(), "the name index's checksum is wrong"};
  if (checksum(strings) != strings_checksum)
    throw Damage{kCellsHeaderBytes + records.size() + index.size(), "the names' checksum is wrong"};

  CellTable table;
  ByteReader record(records);
  for (std::uint32_t i = 0; i < n; ++i) {
    CellRecord r;
    const std::uint64_t at = record.u64(), name = record.u32(), source = record.u32();
    record.require(at <= string_bytes && name + source <= string_bytes - at, "a name lies outside the file");
    const auto* text = reinterpret_cast<const char*>(strings.data() + at);
    r.name.assign(text, name);
    r.source.assign(text + name, source);
    record.u64();
    r.samples = record.u64();
    r.segments = record.u64();
    r.isolated = record.u64();
    r.roots = record.u64();
    record.require(r.samples < UINT32_MAX && r.isolated <= r.roots && r.roots <= r.samples &&
                       r.segments >= r.samples - r.roots && r.segments < UINT32_MAX - r.isolated,
                   "a cell's counts contradict each other");
    r.bounds = record.box();
    DetailPlace place{};
    place.offset = record.u64();
    place.bytes = record.u64();
    place.checksum = record.u64();
    table.records.push_back(std::move(r));
    table.details.push_back(place);
  }
  ByteReader ids(index);
  for (std::uint32_t i = 0; i < n; ++i) {
    table.by_name.push_back(ids.u32());
    ids.require(table.by_name.back() < n, "a cell does not exist");
  }
  return table;
}

DetailRecord decodeDetailRecord(ByteSpan bytes) {
  ByteReader in(bytes);
  in.take(24);
  DetailRecord record{};
  record.samples = in.u64();
  in.take(16);
  record.roots = in.u64();
  in.take(48);
  record.place.offset = in.u64();
  record.place.bytes = in.u64();
  record.place.checksum = in.u64();
  in.require(record.samples < UINT32_MAX && record.roots <= record.samples, "a cell's counts contradict each other");
  return record;
}

}  // namespace filiform::internal
