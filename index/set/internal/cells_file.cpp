#include "index/set/internal/cells_file.h"

#include "index/file/internal/digest.h"

#include <algorithm>

namespace filiform::internal {
namespace {

constexpr std::string_view kCellsMagic = "FILICELL";

// Without a sum: the number may come from a damaged file.
std::uint32_t pagesOf(std::uint32_t cells) { return cells / kCellsOfPage + (cells % kCellsOfPage != 0 ? 1 : 0); }

void writePlace(ByteWriter& out, const CellPagePlace& page) {
  out.u64(page.offset);
  out.u64(page.bytes);
  out.u64(page.checksum);
}

CellPagePlace readPlace(ByteReader& in, std::uint64_t file_bytes) {
  CellPagePlace page{};
  page.offset = in.u64();
  page.bytes = in.u64();
  page.checksum = in.u64();
  in.require(page.offset <= file_bytes && page.bytes <= file_bytes - page.offset, "a page lies outside the file");
  return page;
}

std::string asString(ByteSpan bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

Bytes recordPage(const CellColumns& cells, std::uint32_t begin, std::uint32_t end) {
  ByteWriter page;
  for (std::uint32_t i = begin; i < end; ++i) {
    const CellRecord& record = cells.records[i];
    page.u64(cells.digests[i]);
    page.u64(record.samples);
    page.u64(record.segments);
    page.u64(record.isolated);
    page.u64(record.roots);
    page.box(record.bounds);
    page.u64(cells.details[i].offset);
    page.u64(cells.details[i].bytes);
    page.u64(cells.details[i].checksum);
    page.u32(static_cast<std::uint32_t>(record.name.size()));
    page.u32(static_cast<std::uint32_t>(record.source.size()));
    page.u64(record.removed ? 1 : 0);
  }
  for (std::uint32_t i = begin; i < end; ++i) {
    page.text(cells.records[i].name);
    page.text(cells.records[i].source);
  }
  return page.take();
}

// The next value of an ascending list of numbers below `limit`.
std::uint32_t nextOf(ByteReader& in, std::uint64_t& value, bool first, std::uint64_t limit) {
  const std::uint64_t step = in.varint();
  in.require((first || step > 0) && step < limit && value + step < limit, "a list is out of order");
  return static_cast<std::uint32_t>(value += step);
}

void writeTiles(const std::vector<TileId>& tiles, ByteWriter& out) {
  out.varint(tiles.size());
  TileId last = 0;
  for (const TileId tile : tiles) out.varint(tile - last), last = tile;
}

std::vector<TileId> readTiles(ByteReader& in) {
  std::vector<TileId> tiles;
  std::uint64_t at = 0;
  for (std::uint32_t left = in.varint32(); left > 0; --left) tiles.push_back(nextOf(in, at, tiles.empty(), kNoTile));
  return tiles;
}

// Runs of consecutive ranks.
void writeOddRadii(const std::vector<CellDetail::OddBits>& radii, ByteWriter& out) {
  const auto runEnd = [&radii](std::size_t begin) {
    std::size_t end = begin + 1;
    while (end < radii.size() && radii[end].rank == radii[end - 1].rank + 1) ++end;
    return end;
  };
  std::size_t runs = 0;
  for (std::size_t i = 0; i < radii.size(); i = runEnd(i)) ++runs;
  out.varint(runs);
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < radii.size();) {
    const std::size_t end = runEnd(i);
    out.varint(radii[i].rank - next);
    out.varint(end - i - 1);
    next = radii[end - 1].rank + 1;
    for (; i < end; ++i) out.varint(zigzag(radii[i].difference));
  }
}

std::vector<CellDetail::OddBits> readOddRadii(ByteReader& in, std::uint64_t samples) {
  std::vector<CellDetail::OddBits> radii;
  std::uint64_t next = 0;
  const std::uint32_t runs = in.varint32();
  for (std::uint32_t run = 0; run < runs; ++run) {
    const std::uint64_t gap = in.varint(), count = in.varint();
    in.require((run == 0 || gap > 0) && gap < samples && count < samples && next + gap + count < samples,
               "a radius is of no sample");
    next += gap;
    for (std::uint64_t i = 0; i <= count; ++i)
      radii.push_back({static_cast<std::uint32_t>(next++), unzigzag(in.varint())});
  }
  return radii;
}

}  // namespace

Bytes encodeDetail(const CellDetail& detail) {
  ByteWriter out;
  writeTiles(detail.tiles, out);
  const std::vector<IdRuns::Run>& runs = detail.sample_ids.runs();
  out.varint(runs.size());
  std::uint64_t id = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    // Modulo 2^64: any two ids have a difference.
    const auto first = static_cast<std::uint64_t>(runs[i].first);
    const std::uint32_t count = detail.sample_ids.endOf(i) - runs[i].rank;
    out.varint(zigzag(static_cast<std::int64_t>(first - id)));
    out.varint(count - 1);
    id = first + count;
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
  out.sizedText(detail.header);
  writeOddRadii(detail.odd_radii, out);
  return out.take();
}

std::vector<TileId> decodeTiles(ByteSpan detail) {
  ByteReader in(detail);
  return readTiles(in);
}

CellDetail decodeDetail(ByteSpan bytes, std::uint64_t samples) {
  ByteReader in(bytes);
  CellDetail detail;
  detail.tiles = readTiles(in);
  const std::uint32_t runs = in.varint32();
  std::uint64_t id = 0;
  for (std::uint32_t i = 0; i < runs; ++i) {
    id += static_cast<std::uint64_t>(unzigzag(in.varint()));
    const std::uint64_t count = std::uint64_t{in.varint32()} + 1;
    in.require(count <= samples - detail.sample_ids.size(), "more sample ids than samples");
    detail.sample_ids.add(static_cast<std::int64_t>(id), static_cast<std::uint32_t>(count));
    id += count;
  }
  in.require(detail.sample_ids.size() == samples, "sample ids are missing");
  const std::uint32_t roots = in.varint32();
  std::uint64_t at = 0;
  for (std::uint32_t i = 0; i < roots; ++i) {
    const std::uint32_t rank = nextOf(in, at, i == 0, samples);
    const float radius_um = in.f32();
    detail.roots.push_back({rank, radius_um, in.u16()});
  }
  const std::uint32_t blocks = in.varint32();
  at = 0;
  for (std::uint32_t i = 0; i < blocks; ++i) detail.block_starts.push_back(nextOf(in, at, i == 0, samples));
  detail.header = asString(in.take(in.varint32()));
  detail.odd_radii = readOddRadii(in, samples);
  in.require(in.left() == 0, "bytes beyond the end of the cell");
  return detail;
}

Bytes withTiles(ByteSpan detail, const std::function<void(std::vector<TileId>& tiles)>& change) {
  ByteReader in(detail);
  std::vector<TileId> tiles = readTiles(in);
  change(tiles);
  ByteWriter out;
  writeTiles(tiles, out);
  out.append(detail.subspan(in.offset()));
  return out.take();
}

Bytes cellsHeader() {
  ByteWriter out;
  writeMagic(out, kCellsMagic);
  out.u32(0);
  return out.take();
}

Bytes writeCellPages(const CellColumns& cells, std::uint64_t at, const std::function<void(ByteSpan)>& use) {
  const auto n = static_cast<std::uint32_t>(cells.records.size());
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < n; ++i)
    if (!cells.records[i].removed) order.push_back(i);
  const auto named = static_cast<std::uint32_t>(order.size());
  ByteWriter root;
  root.u32(n);
  root.u32(named);
  const auto add = [&](const Bytes& page) {
    writePlace(root, {at, page.size(), checksum(page)});
    use(page);
    at += page.size();
  };
  for (std::uint32_t begin = 0; begin < n; begin += kCellsOfPage)
    add(recordPage(cells, begin, std::min(n, begin + kCellsOfPage)));
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const int difference = cells.records[a].name.compare(cells.records[b].name);
    return difference != 0 ? difference < 0 : a < b;
  });
  for (std::uint32_t begin = 0; begin < named; begin += kCellsOfPage) {
    ByteWriter page;
    for (std::uint32_t i = begin; i < std::min(named, begin + kCellsOfPage); ++i) {
      const std::string& name = cells.records[order[i]].name;
      page.u32(order[i]);
      page.u32(static_cast<std::uint32_t>(name.size()));
      page.text(name);
    }
    const std::string& first = cells.records[order[begin]].name;
    add(page.take());
    root.u32(static_cast<std::uint32_t>(first.size()));
    root.text(first);
  }
  return root.take();
}

CellsRoot decodeCellsRoot(ByteSpan bytes, std::uint64_t file_bytes) {
  ByteReader in(bytes);
  CellsRoot root;
  root.cells = in.u32();
  root.named = in.u32();
  in.require(root.named <= root.cells, "more names than cells");
  const std::uint32_t pages = pagesOf(root.cells);
  in.require(bytes.size() / 24 >= pages, "more cells than there are bytes");
  for (std::uint32_t page = 0; page < pages; ++page) root.records.push_back(readPlace(in, file_bytes));
  for (std::uint32_t page = 0; page < pagesOf(root.named); ++page) {
    root.names.push_back(readPlace(in, file_bytes));
    root.first_names.push_back(asString(in.take(in.u32())));
    in.require(page == 0 || root.first_names[page - 1] <= root.first_names[page], "the names are out of order");
  }
  in.require(in.left() == 0, "bytes beyond the end of the pages");
  return root;
}

std::uint32_t cellsOfPage(std::uint32_t cells, std::uint32_t page) {
  return std::min(kCellsOfPage, cells - page * kCellsOfPage);
}

CellPage decodeCellPage(ByteSpan bytes, std::uint32_t count, std::uint64_t file_bytes) {
  ByteReader in(bytes.first(std::min<std::size_t>(bytes.size(), count * kCellRecordBytes)));
  ByteReader text(bytes.subspan(std::min<std::size_t>(bytes.size(), count * kCellRecordBytes)));
  CellPage page;
  for (std::uint32_t i = 0; i < count; ++i) {
    CellRecord r;
    page.digests.push_back(in.u64());
    r.samples = in.u64();
    r.segments = in.u64();
    r.isolated = in.u64();
    r.roots = in.u64();
    in.require(r.samples < UINT32_MAX && r.isolated <= r.roots && r.roots <= r.samples &&
                   r.segments >= r.samples - r.roots && r.segments < UINT32_MAX - r.isolated,
               "a cell's counts contradict each other");
    r.bounds = in.box();
    DetailPlace place{};
    place.offset = in.u64();
    place.bytes = in.u64();
    place.checksum = in.u64();
    in.require(place.offset <= file_bytes && place.bytes <= file_bytes - place.offset, "a cell lies outside the file");
    const std::uint32_t name = in.u32(), source = in.u32();
    const std::uint64_t removed = in.u64();
    in.require(removed <= 1 && (removed == 0 || (r.samples == 0 && name == 0)), "a removed cell is not empty");
    r.removed = removed == 1;
    r.name = asString(text.take(name));
    r.source = asString(text.take(source));
    page.records.push_back(std::move(r));
    page.details.push_back(place);
  }
  text.require(text.left() == 0, "bytes beyond the end of the names");
  return page;
}

NamePage decodeNamePage(const CellsRoot& root, std::uint32_t page, ByteSpan bytes) {
  ByteReader in(bytes);
  NamePage found;
  for (std::uint32_t i = 0; i < cellsOfPage(root.named, page); ++i) {
    const std::uint32_t id = in.u32();
    in.require(id < root.cells, "a cell does not exist");
    found.emplace_back(asString(in.take(in.u32())), id);
    in.require(i == 0 ? found.back().first == root.first_names[page] : found[i - 1] < found[i],
               "the names are out of order");
  }
  in.require(in.left() == 0, "bytes beyond the end of the names");
  return found;
}

}  // namespace filiform::internal
