#include "index/set/internal/set_files.h"

#include "index/set/tile_source.h"
#include "index/whole_number.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>

#include <nlohmann/json.hpp>

namespace filiform::internal {
namespace {

constexpr std::string_view kDirectoryMagic = "FILIDIRY", kCellsMagic = "FILICELL", kLandmarksMagic = "FILISMPL",
                           kPackMagic = "FILIPACK";
constexpr std::size_t kRootHeaderBytes = 48, kRootEntryBytes = 72, kEntryBytes = 128, kRootChecksumAt = 40,
                      kDecodedAt = 96;
constexpr std::size_t kLandmarksHeaderBytes = 40, kLandmarkBytes = 36;
constexpr std::int64_t kEdge = std::int64_t{1} << (kMortonAxisBits - 1);

void box(ByteWriter& out, const GridBox& b) {
  out.point(b.lo);
  out.point(b.hi);
}

std::size_t rootBytes(std::size_t pages) { return kRootHeaderBytes + pages * kRootEntryBytes; }

std::uint32_t tilesPerPage(std::size_t tiles) {
  std::uint32_t per_page = 4096;
  while (rootBytes((tiles + per_page - 1) / per_page) > kMaxRootBytes) per_page *= 2;
  return per_page;
}

void entry(ByteWriter& out, const TileEntry& e, const TileLocation& at) {
  out.key(e.key.low);
  out.u32(static_cast<std::uint32_t>(e.key.depth));
  out.u32(at.pack);
  box(out, e.content);
  out.u32(e.owned);
  out.u32(e.stored);
  out.u32(e.isolated);
  out.u32(at.geometry_bytes);
  out.u32(at.appearance_bytes);
  out.u32(0);
  out.u64(e.decoded_bytes);
  out.u64(at.offset);
  out.u64(at.geometry_checksum);
  out.u64(at.appearance_checksum);
}

// Reads whole words: a page has thousands of entries.
void readEntry(ByteReader& in, TileEntry& e, TileLocation& at) {
  const std::uint8_t* const bytes = in.take(kEntryBytes).data();
  const auto u64 = [bytes](std::size_t offset) { return loadLittle64(bytes + offset); };
  const auto low32 = [u64](std::size_t offset) { return static_cast<std::uint32_t>(u64(offset)); };
  const auto high32 = [u64](std::size_t offset) { return static_cast<std::uint32_t>(u64(offset) >> 32); };
  e.key.low = MortonKey{u64(0)} | MortonKey{u64(8)} << 64;
  const std::uint32_t depth = low32(16);
  in.require(depth <= static_cast<std::uint32_t>(kMortonBits) && e.key.low >> kMortonBits == 0,
             "a block lies outside the grid");
  e.key.depth = static_cast<int>(depth);
  in.require(e.key.high() - e.key.low == BlockKey{0, e.key.depth}.high(), "a block's key is invalid");
  at.pack = high32(16);
  for (Eigen::Index i = 0; i < 3; ++i) {
    e.content.lo[i] = static_cast<std::int64_t>(u64(24 + 8 * static_cast<std::size_t>(i)));
    e.content.hi[i] = static_cast<std::int64_t>(u64(48 + 8 * static_cast<std::size_t>(i)));
  }
  e.owned = low32(72);
  e.stored = high32(72);
  e.isolated = low32(80);
  in.require(e.owned <= e.stored && e.isolated <= e.owned && e.stored > 0, "a tile's counts contradict each other");
  at.geometry_bytes = high32(80);
  at.appearance_bytes = low32(88);
  in.require(high32(88) == 0, "a reserved field is not zero");
  e.decoded_bytes = u64(kDecodedAt);
  at.offset = u64(104);
  at.geometry_checksum = u64(112);
  at.appearance_checksum = u64(120);
}

// Bytes that are not valid UTF-8 become \xNN, so that JSON can hold any file name.
std::string asText(const std::string& bytes) {
  const auto valid = [&](std::size_t at, std::size_t& length) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
    const unsigned lead = byte(at);
    length = lead < 0x80                   ? 1
             : lead >= 0xC2 && lead < 0xE0 ? 2
             : lead >= 0xE0 && lead < 0xF0 ? 3
             : lead >= 0xF0 && lead < 0xF5 ? 4
                                           : 0;
    if (length == 0 || at + length > bytes.size()) return false;
    for (std::size_t i = 1; i < length; ++i)
      if ((byte(at + i) & 0xC0) != 0x80) return false;
    if (length == 3 && ((lead == 0xE0 && byte(at + 1) < 0xA0) || (lead == 0xED && byte(at + 1) > 0x9F))) return false;
    return !(length == 4 && ((lead == 0xF0 && byte(at + 1) < 0x90) || (lead == 0xF4 && byte(at + 1) > 0x8F)));
  };
  std::string text;
  for (std::size_t i = 0, length = 0; i < bytes.size(); i += length) {
    if (valid(i, length)) {
      text.append(bytes, i, length);
    } else {
      char escaped[8];
      std::snprintf(escaped, sizeof escaped, "\\x%02X", static_cast<unsigned>(static_cast<unsigned char>(bytes[i])));
      text += escaped;
      length = 1;
    }
  }
  return text;
}

nlohmann::ordered_json point(const Grid& grid, const GridPoint& p) {
  const Vector3d p_W = grid.toWorld(p);
  return {p_W.x(), p_W.y(), p_W.z()};
}

std::uint64_t fromHex16(const std::string& text) {
  if (text.size() != 16 || text.find_first_not_of("0123456789abcdef") != std::string::npos)
    throw Damage{0, "a digest is malformed"};
  return std::stoull(text, nullptr, 16);
}

}  // namespace

std::string packFile(std::uint32_t pack) {
  char name[32];
  std::snprintf(name, sizeof name, "tiles-%05u.pack", pack);
  return name;
}

void writeMagic(ByteWriter& out, std::string_view magic) {
  out.text(magic);
  out.u32(kFormatVersion);
}

void checkMagic(ByteReader& in, std::string_view magic) {
  const ByteSpan found = in.take(magic.size());
  in.require(std::equal(found.begin(), found.end(), magic.begin()), "not a file of this kind");
  const std::uint32_t version = in.u32();
  if (version != kFormatVersion)
    in.fail("format version " + std::to_string(version) + ", this program reads " + std::to_string(kFormatVersion));
}

Bytes packHeader(std::string_view magic, std::uint32_t pack) {
  ByteWriter out;
  writeMagic(out, magic);
  out.u32(pack);
  return out.take();
}
Bytes packHeader(std::uint32_t pack) { return packHeader(kPackMagic, pack); }

Bytes encodeDirectory(const DirectoryContents& directory) {
  const std::size_t tiles = directory.entries.size();
  const std::uint32_t per_page = tilesPerPage(tiles);
  const std::size_t pages = (tiles + per_page - 1) / per_page;
  ByteWriter root, body;
  writeMagic(root, kDirectoryMagic);
  root.u32(per_page);
  root.u32(static_cast<std::uint32_t>(tiles));
  root.u32(static_cast<std::uint32_t>(pages));
  root.u32(directory.long_tile);
  root.u32(directory.capacity);
  root.i32(directory.grid.exponent());
  root.u32(0);
  root.u64(0);
  for (std::size_t page = 0; page < pages; ++page) {
    const std::size_t begin = page * per_page, end = std::min<std::size_t>(begin + per_page, tiles), from = body.size();
    GridBox content;
    for (std::size_t t = begin; t < end; ++t) {
      entry(body, directory.entries[t], directory.locations[t]);
      content.extend(directory.entries[t].content);
    }
    root.key(directory.entries[begin].key.low);
    box(root, content);
    root.u64(checksum(ByteSpan(body.bytes()).subspan(from)));
  }
  root.setU64(kRootChecksumAt, checksum(root.bytes()));
  root.append(body.bytes());
  return root.take();
}

DirectoryRoot decodeDirectoryRoot(std::uint64_t file_bytes, const ReadPart& read) {
  Bytes bytes(std::min<std::uint64_t>(file_bytes, kMaxRootBytes));
  read(0, bytes);
  ByteReader in(bytes);
  checkMagic(in, kDirectoryMagic);
  DirectoryRoot root;
  root.page_tiles = in.u32();
  root.tiles = in.u32();
  const std::uint32_t pages = in.u32();
  root.long_tile = in.u32();
  root.capacity = in.u32();
  const std::int32_t exponent = in.i32();
  in.require(exponent >= Grid::kMinExponent && exponent <= Grid::kMaxExponent, "the quantum is out of range");
  root.grid = Grid(exponent);
  in.require(in.u32() == 0, "a reserved field is not zero");
  in.require(root.page_tiles == tilesPerPage(root.tiles) &&
                 pages == (std::uint64_t{root.tiles} + root.page_tiles - 1) / root.page_tiles &&
                 file_bytes == rootBytes(pages) + std::uint64_t{root.tiles} * kEntryBytes,
             "the number of tiles does not fit the file");
  const std::uint64_t stated = in.u64();
  std::fill_n(bytes.begin() + kRootChecksumAt, 8, std::uint8_t{0});
  if (checksum(ByteSpan(bytes).first(rootBytes(pages))) != stated) throw Damage{0, "the root page's checksum is wrong"};
  in.require(root.long_tile == kNoTile || root.long_tile + 1 == root.tiles, "the long-segment tile is not the last");
  root.pages.resize(pages);
  for (std::uint32_t page = 0; page < pages; ++page) {
    DirectoryRoot::Page& p = root.pages[page];
    p.low = in.key();
    p.content = in.box();
    p.checksum = in.u64();
    in.require(page == 0 || root.pageBegin(page) == root.long_tile || p.low > root.pages[page - 1].low,
               "the pages are out of order");
  }
  return root;
}

namespace {

// Reads and checks a page; `at` is its position in the file.
std::uint64_t readPage(const DirectoryRoot& root, std::uint32_t page, const ReadPart& read, Bytes& bytes) {
  const std::uint64_t begin = root.pageBegin(page), at = rootBytes(root.pages.size()) + begin * kEntryBytes;
  bytes.resize((root.pageEnd(page) - begin) * kEntryBytes);
  read(at, bytes);
  if (checksum(bytes) != root.pages[page].checksum) {
    std::string what = "page " + std::to_string(page);
    what += "'s checksum is wrong";
    throw Damage{at, what};
  }
  return at;
}

}  // namespace

DirectoryPage decodeDirectoryPage(const DirectoryRoot& root, std::uint32_t page, const ReadPart& read) {
  Bytes bytes;
  const std::uint64_t at = readPage(root, page, read, bytes);
  const TileId begin = root.pageBegin(page), end = root.pageEnd(page);
  const DirectoryRoot::Page& stated = root.pages[page];
  DirectoryPage found;
  found.entries.resize(end - begin);
  found.locations.resize(end - begin);
  ByteReader in(bytes);
  try {
    GridBox content;
    for (TileId t = begin; t < end; ++t) {
      TileEntry& e = found.entries[t - begin];
      readEntry(in, e, found.locations[t - begin]);
      content.extend(e.content);
      in.require(t == begin ? e.key.low == stated.low
                            : t == root.long_tile || e.key.low > found.entries[t - begin - 1].key.high(),
                 "the leaves are out of order");
    }
    const TileEntry& last = found.entries.back();
    in.require(end >= root.leaf_count() || last.key.high() < root.pages[page + 1].low, "the leaves are out of order");
    in.require(content.lo == stated.content.lo && content.hi == stated.content.hi,
               "the content of a page differs from the root page");
  } catch (const Damage& damage) {
    throw Damage{at + damage.offset, damage.what};
  }
  return found;
}

void readDecodedBytes(const DirectoryRoot& root, std::uint32_t page, const ReadPart& read, Bytes& scratch,
                      std::vector<std::uint64_t>& decoded_bytes) {
  readPage(root, page, read, scratch);
  decoded_bytes.clear();
  for (std::size_t at = 0; at < scratch.size(); at += kEntryBytes)
    decoded_bytes.push_back(loadLittle64(scratch.data() + at + kDecodedAt));
}

DirectoryContents decodeDirectory(std::uint64_t file_bytes, const ReadPart& read) {
  const DirectoryRoot root = decodeDirectoryRoot(file_bytes, read);
  DirectoryContents directory{root.grid, root.capacity, root.long_tile, {}, {}};
  for (std::uint32_t page = 0; page < root.pages.size(); ++page) {
    const DirectoryPage found = decodeDirectoryPage(root, page, read);
    directory.entries.insert(directory.entries.end(), found.entries.begin(), found.entries.end());
    directory.locations.insert(directory.locations.end(), found.locations.begin(), found.locations.end());
  }
  return directory;
}

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
    box(table, record.bounds);
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
  out.u64(checksum({reinterpret_cast<const std::uint8_t*>(strings.data()), strings.size()}));
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

Bytes encodeLandmarks(const Landmarks& samples) {
  ByteWriter body, out;
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    body.point(samples.points[i]);
    body.u32(samples.segments[i].cell);
    body.u32(samples.segments[i].segment);
    body.f32(samples.t[i]);
  }
  writeMagic(out, kLandmarksMagic);
  out.u32(static_cast<std::uint32_t>(samples.points.size()));
  out.f64(samples.covering_radius_um);
  out.u64(checksum(body.bytes()));
  out.u64(checksum(out.bytes()));
  out.append(body.bytes());
  return out.take();
}

Landmarks decodeLandmarks(ByteSpan bytes) {
  ByteReader in(bytes);
  checkMagic(in, kLandmarksMagic);
  const std::uint32_t n = in.u32();
  Landmarks samples;
  samples.covering_radius_um = in.f64();
  const std::uint64_t body_checksum = in.u64(), header_checksum = in.u64();
  if (checksum(bytes.first(kLandmarksHeaderBytes - 8)) != header_checksum)
    throw Damage{0, "the header's checksum is wrong"};
  in.require(in.left() == std::uint64_t{n} * kLandmarkBytes, "the number of points does not fit the file");
  if (checksum(bytes.subspan(kLandmarksHeaderBytes)) != body_checksum)
    throw Damage{kLandmarksHeaderBytes, "the points' checksum is wrong"};
  in.require(std::isfinite(samples.covering_radius_um) && samples.covering_radius_um >= 0,
             "the covering radius is not a finite number, 0 or more");
  samples.points.reserve(n);
  samples.segments.reserve(n);
  samples.t.reserve(n);
  // Reads whole words: the first jump waits for this.
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint8_t* const at = in.take(kLandmarkBytes).data();
    const auto coordinate = [at](std::size_t axis) { return static_cast<std::int64_t>(loadLittle64(at + 8 * axis)); };
    samples.points.emplace_back(coordinate(0), coordinate(1), coordinate(2));
    in.require((samples.points.back().array() >= -kEdge).all() && (samples.points.back().array() < kEdge).all(),
               "a point lies outside the grid");
    const std::uint64_t id = loadLittle64(at + 24), last = loadLittle64(at + 28);
    samples.segments.push_back({static_cast<std::uint32_t>(id), static_cast<std::uint32_t>(id >> 32)});
    samples.t.push_back(std::bit_cast<float>(static_cast<std::uint32_t>(last >> 32)));
    in.require(samples.t.back() >= 0 && samples.t.back() <= 1, "a point lies beyond its segment");
  }
  return samples;
}

std::string encodeManifest(const Manifest& manifest, const Provenance& provenance) {
  nlohmann::ordered_json json;
  json["format"] = "filiform tile set";
  json["version"] = kFormatVersion;
  json["units"] = "um";
  json["quantum_exponent"] = manifest.grid.exponent();
  json["quantum_um"] = manifest.grid.quantum_um();
  json["capacity"] = manifest.capacity;
  json["bounds_um"] = nullptr;
  json["bounds_quanta"] = nullptr;
  if (!manifest.bounds.empty()) {
    const GridPoint &lo = manifest.bounds.lo, &hi = manifest.bounds.hi;
    json["bounds_um"] = {point(manifest.grid, lo), point(manifest.grid, hi)};
    json["bounds_quanta"] = {{lo.x(), lo.y(), lo.z()}, {hi.x(), hi.y(), hi.z()}};
  }
  const SetCounts& c = manifest.counts;
  json["counts"] = {{"cells", c.cells},
                    {"samples", c.samples},
                    {"segments", c.segments},
                    {"isolated", c.isolated},
                    {"roots", c.roots},
                    {"tiles", c.tiles},
                    {"stored_segments", c.stored_segments},
                    {"decoded_bytes", c.decoded_bytes}};
  json["covering_radius_um"] = manifest.covering_radius_um;
  json["files"] = nlohmann::ordered_json::array();
  for (const SetFile& file : manifest.files)
    json["files"].push_back({{"name", file.name}, {"bytes", file.bytes}, {"xxh3", hex16(file.digest)}});
  nlohmann::ordered_json codes = nlohmann::ordered_json::object();
  for (const auto& [code, count] : provenance.codes) codes[asText(code)] = count;
  json["provenance"] = {
      {"sources", provenance.sources.size()}, {"refused", provenance.refused.size()}, {"codes", codes}};
  return json.dump(2) + "\n";
}

void writeProvenance(const Provenance& provenance, const std::function<void(std::string_view piece)>& use) {
  using Json = nlohmann::ordered_json;
  use("{\n\"sources\": [");
  const char* between = "\n";
  for (const Provenance::Source& s : provenance.sources) {
    const Json source = {{"name", asText(s.name)}, {"bytes", s.bytes}, {"xxh3", hex16(s.digest)}, {"cells", s.cells}};
    std::string text = between + source.dump();
    between = ",\n";
    if (s.dropped) {
      text.pop_back();
      use(text + ",\"dropped\":\"");
      s.dropped([&](std::string_view piece) {
        if (piece.find_first_not_of("0123456789,") != std::string_view::npos) {
          text = Json(asText(std::string(piece))).dump();
          piece = std::string_view(text).substr(1, text.size() - 2);
        }
        use(piece);
      });
      text = "\"}";
    }
    use(text);
  }
  use("\n],\n\"refused\": [");
  between = "\n";
  for (const Provenance::Refused& r : provenance.refused) {
    use(between + Json{{"name", asText(r.name)}, {"code", asText(r.code)}, {"reason", asText(r.reason)}}.dump());
    between = ",\n";
  }
  use("\n]\n}\n");
}

Manifest decodeManifest(const std::string& text) {
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    if (json.at("format") != "filiform tile set") throw Damage{0, "not the manifest of a tile set"};
    if (json.at("version") != kFormatVersion)
      throw Damage{
          0, "format version " + json.at("version").dump() + ", this program reads " + std::to_string(kFormatVersion)};
    Manifest manifest;
    const int exponent = wholeNumber<int>(json.at("quantum_exponent"));
    if (exponent < Grid::kMinExponent || exponent > Grid::kMaxExponent) throw Damage{0, "the quantum is out of range"};
    manifest.grid = Grid(exponent);
    manifest.capacity = wholeNumber<std::uint32_t>(json.at("capacity"));
    if (!json.at("bounds_quanta").is_null()) {
      const nlohmann::json& corners = json.at("bounds_quanta");
      if (corners.size() != 2 || corners.at(0).size() != 3 || corners.at(1).size() != 3)
        throw Damage{0, "the bounds are malformed"};
      for (std::size_t i = 0; i < 3; ++i) {
        manifest.bounds.lo[static_cast<Eigen::Index>(i)] = wholeNumber<std::int64_t>(corners.at(0).at(i));
        manifest.bounds.hi[static_cast<Eigen::Index>(i)] = wholeNumber<std::int64_t>(corners.at(1).at(i));
      }
    }
    const nlohmann::json& counts = json.at("counts");
    const auto count = [&](const char* name) { return wholeNumber<std::uint64_t>(counts.at(name)); };
    manifest.counts = {count("cells"), count("samples"), count("segments"),        count("isolated"),
                       count("roots"), count("tiles"),   count("stored_segments"), count("decoded_bytes")};
    manifest.covering_radius_um = json.at("covering_radius_um").get<double>();
    manifest.refused = wholeNumber<std::uint64_t>(json.at("provenance").at("refused"));
    for (const nlohmann::json& file : json.at("files")) {
      manifest.files.push_back({file.at("name").get<std::string>(), wholeNumber<std::uint64_t>(file.at("bytes")),
                                fromHex16(file.at("xxh3").get<std::string>())});
      const std::string& name = manifest.files.back().name;
      if (!isTileFileName(name) || name.find('/') != std::string::npos) throw Damage{0, "a file has an invalid name"};
    }
    return manifest;
  } catch (const nlohmann::json::exception& error) {
    throw Damage{0, std::string("not a manifest: ") + error.what()};
  } catch (const std::out_of_range& error) {
    throw Damage{0, std::string("not a manifest: ") + error.what()};
  }
}

std::string revisionName(const std::string& manifest) {
  return "r-" + hex16(checksum({reinterpret_cast<const std::uint8_t*>(manifest.data()), manifest.size()}));
}

bool isRevisionName(const std::string& name) {
  return name.size() == 18 && name.starts_with("r-") &&
         name.find_first_not_of("0123456789abcdef", 2) == std::string::npos;
}

}  // namespace filiform::internal
