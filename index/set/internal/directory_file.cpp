#include "index/set/internal/directory_file.h"

#include "index/file/internal/digest.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::string_view kDirectoryMagic = "FILIDIRY";
constexpr std::size_t kHeaderBytes = 16, kRootHeaderBytes = 16, kRecordBytes = 72, kEntryBytes = 128;
constexpr std::uint32_t kMostPageItems = std::uint32_t{1} << 20;

void entry(ByteWriter& out, const TileEntry& e, const TileLocation& at) {
  out.key(e.key.low);
  out.u32(static_cast<std::uint32_t>(e.key.depth));
  out.u32(at.pack);
  out.box(e.content);
  out.u32(e.owned);
  out.u32(e.stored);
  out.u32(e.isolated);
  out.u32(at.geometry_bytes);
  out.u32(at.appearance_bytes);
  out.u16(at.unit_tiles);
  out.u16(at.unit_rank);
  out.u64(e.decoded_bytes);
  out.u64(at.offset);
  out.u64(at.geometry_checksum);
  out.u64(at.appearance_checksum);
}

// Reads whole words: a page has hundreds of entries.
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
  at.unit_tiles = static_cast<std::uint16_t>(high32(88));
  at.unit_rank = static_cast<std::uint16_t>(high32(88) >> 16);
  in.require(at.unit_rank < at.unit_tiles, "a tile lies outside its unit");
  e.decoded_bytes = u64(96);
  at.offset = u64(104);
  at.geometry_checksum = u64(112);
  at.appearance_checksum = u64(120);
}

void record(ByteWriter& out, const DirectoryRecord& r) {
  out.key(r.low);
  out.box(r.content);
  out.u64(r.checksum);
}

DirectoryRecord readRecord(ByteReader& in) {
  DirectoryRecord r;
  r.low = in.key();
  r.content = in.box();
  r.checksum = in.u64();
  return r;
}

bool same(const GridBox& a, const GridBox& b) { return a.lo == b.lo && a.hi == b.hi; }

std::uint64_t groupAt(const DirectoryRoot& root, std::uint32_t group) {
  return kHeaderBytes + std::uint64_t{root.groupBegin(group)} * kRecordBytes;
}
std::uint64_t pageAt(const DirectoryRoot& root, std::uint32_t page) {
  return kHeaderBytes + std::uint64_t{root.page_count()} * kRecordBytes +
         std::uint64_t{root.pageBegin(page)} * kEntryBytes;
}

// Reads a page and compares its checksum.
Bytes readPage(std::uint64_t at, std::uint64_t size, std::uint64_t stated, const char* kind, std::uint32_t number,
               const ReadPart& read) {
  Bytes bytes = read(at, size);
  if (checksum(bytes) != stated) throw Damage{at, kind + std::to_string(number) + "'s checksum is wrong"};
  return bytes;
}

}  // namespace

Bytes writeDirectory(const DirectoryContents& directory, std::uint32_t page_tiles,
                     const std::function<void(ByteSpan page)>& use) {
  DirectoryRoot root;
  root.tiles = static_cast<TileId>(directory.entries.size());
  root.long_tile = directory.long_tile;
  root.page_tiles = root.group_pages = page_tiles;
  const auto groups = [&] { return (root.page_count() + root.group_pages - 1) / root.group_pages; };
  while (kRootHeaderBytes + groups() * kRecordBytes > kMaxRootBytes) root.page_tiles *= 2, root.group_pages *= 2;
  ByteWriter header;
  writeMagic(header, kDirectoryMagic);
  header.u32(0);
  use(header.bytes());
  // Inner pages come first and state the checksums of leaf pages. Each leaf page is encoded twice, to hold one only.
  const auto leafPage = [&](std::uint32_t page) {
    ByteWriter bytes;
    for (TileId t = root.pageBegin(page); t < root.pageEnd(page); ++t)
      entry(bytes, directory.entries[t], directory.locations[t]);
    return bytes.take();
  };
  for (std::uint32_t group = 0; group < groups(); ++group) {
    DirectoryRecord whole;
    ByteWriter inner;
    for (std::uint32_t page = root.groupBegin(group); page < root.groupEnd(group); ++page) {
      DirectoryRecord one;
      for (TileId t = root.pageBegin(page); t < root.pageEnd(page); ++t)
        one.content.extend(directory.entries[t].content);
      one.low = directory.entries[root.pageBegin(page)].key.low;
      one.checksum = checksum(leafPage(page));
      record(inner, one);
      whole.content.extend(one.content);
      if (page == root.groupBegin(group)) whole.low = one.low;
    }
    whole.checksum = checksum(inner.bytes());
    use(inner.bytes());
    root.groups.push_back(whole);
  }
  for (std::uint32_t page = 0; page < root.page_count(); ++page) use(leafPage(page));
  ByteWriter out;
  out.u32(root.tiles);
  out.u32(root.long_tile);
  out.u32(root.page_tiles);
  out.u32(root.group_pages);
  for (const DirectoryRecord& group : root.groups) record(out, group);
  return out.take();
}

DirectoryRoot decodeDirectoryRoot(ByteSpan bytes, std::uint64_t file_bytes) {
  ByteReader in(bytes);
  DirectoryRoot root;
  root.tiles = in.u32();
  root.long_tile = in.u32();
  root.page_tiles = in.u32();
  root.group_pages = in.u32();
  in.require(std::has_single_bit(root.page_tiles) && root.page_tiles <= kMostPageItems &&
                 std::has_single_bit(root.group_pages) && root.group_pages <= kMostPageItems,
             "the size of a page is out of range");
  const std::uint64_t pages = root.page_count(), groups = (pages + root.group_pages - 1) / root.group_pages;
  in.require(bytes.size() <= kMaxRootBytes && in.left() == groups * kRecordBytes &&
                 file_bytes == kHeaderBytes + pages * kRecordBytes + std::uint64_t{root.tiles} * kEntryBytes,
             "the number of tiles does not fit the file");
  in.require(root.long_tile == kNoTile || root.long_tile + 1 == root.tiles, "the long-segment tile is not the last");
  for (std::uint32_t group = 0; group < groups; ++group) {
    root.groups.push_back(readRecord(in));
    in.require(group == 0 || root.pageBegin(root.groupBegin(group)) == root.long_tile ||
                   root.groups[group].low > root.groups[group - 1].low,
               "the pages are out of order");
  }
  return root;
}

DirectoryGroup decodeDirectoryGroup(const DirectoryRoot& root, std::uint32_t group, const ReadPart& read) {
  const std::uint64_t at = groupAt(root, group);
  const std::uint32_t begin = root.groupBegin(group), end = root.groupEnd(group);
  const DirectoryRecord& stated = root.groups[group];
  const Bytes bytes = readPage(at, (end - begin) * kRecordBytes, stated.checksum, "inner page ", group, read);
  ByteReader in(bytes);
  DirectoryGroup found;
  try {
    GridBox content;
    for (std::uint32_t page = begin; page < end; ++page) {
      const DirectoryRecord r = readRecord(in);
      content.extend(r.content);
      in.require(page == begin                            ? r.low == stated.low
                 : root.pageBegin(page) == root.long_tile ? true
                                                          : r.low > found.back().low,
                 "the pages are out of order");
      found.push_back(r);
    }
    const bool next_has_leaves = group + 1 < root.groups.size() && root.pageBegin(end) < root.leaf_count();
    in.require(!next_has_leaves || found.back().low < root.groups[group + 1].low, "the pages are out of order");
    in.require(same(content, stated.content), "the content of an inner page differs from the root");
  } catch (const Damage& damage) {
    throw Damage{at + damage.offset, damage.what};
  }
  return found;
}

DirectoryPage decodeDirectoryPage(const DirectoryRoot& root, const DirectoryGroup& group, std::uint32_t page,
                                  const ReadPart& read) {
  const std::uint64_t at = pageAt(root, page);
  const TileId begin = root.pageBegin(page), end = root.pageEnd(page);
  const std::uint32_t in_group = page % root.group_pages;
  const DirectoryRecord& stated = group[in_group];
  const Bytes bytes = readPage(at, std::uint64_t{end - begin} * kEntryBytes, stated.checksum, "page ", page, read);
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
    if (end < root.leaf_count()) {
      const MortonKey next =
          in_group + 1 < group.size() ? group[in_group + 1].low : root.groups[page / root.group_pages + 1].low;
      in.require(found.entries.back().key.high() < next, "the leaves are out of order");
    }
    in.require(same(content, stated.content), "the content of a page differs from its inner page");
  } catch (const Damage& damage) {
    throw Damage{at + damage.offset, damage.what};
  }
  return found;
}

DirectoryContents decodeDirectory(ByteSpan root_bytes, std::uint64_t file_bytes, const ReadPart& read) {
  const DirectoryRoot root = decodeDirectoryRoot(root_bytes, file_bytes);
  DirectoryContents directory{root.long_tile, {}, {}};
  for (std::uint32_t number = 0; number < root.groups.size(); ++number) {
    const DirectoryGroup group = decodeDirectoryGroup(root, number, read);
    for (std::uint32_t page = root.groupBegin(number); page < root.groupEnd(number); ++page) {
      const DirectoryPage found = decodeDirectoryPage(root, group, page, read);
      directory.entries.insert(directory.entries.end(), found.entries.begin(), found.entries.end());
      directory.locations.insert(directory.locations.end(), found.locations.begin(), found.locations.end());
    }
  }
  return directory;
}

}  // namespace filiform::internal
