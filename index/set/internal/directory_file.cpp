#include "index/set/internal/directory_file.h"

#include "index/file/internal/digest.h"

#include <algorithm>

namespace filiform::internal {
namespace {

constexpr std::string_view kDirectoryMagic = "FILIDIRY";
constexpr std::size_t kRootHeaderBytes = 48, kRootEntryBytes = 72, kEntryBytes = 128, kRootChecksumAt = 40,
                      kDecodedAt = 96;

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
  out.box(e.content);
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
    root.box(content);
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

}  // namespace filiform::internal
