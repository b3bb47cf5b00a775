#include "index/set/internal/directory_file.h"

#include "index/file/internal/digest.h"
#include "index/geometry/partition.h"
#include "index/set/internal/old_directory.h"

#include <array>
#include <bit>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::string_view kDirectoryMagic = "FILIDIRY";
constexpr std::size_t kRootHeaderBytes = 16;
constexpr std::size_t kLeastRecordBytes = 18, kLeastEntryBytes = 30;
constexpr std::size_t kPageBoxes = 4;  // of the record of a leaf page; of an inner page: at least these
// Groups have fewer pages if the root stays that small.
constexpr std::uint32_t kUsualGroup = 4;
constexpr std::size_t kSmallRootBytes = std::size_t{16} << 10;
constexpr std::uint32_t kMostPageItems = std::uint32_t{1} << 20;
constexpr int kBoxBits = 8;  // of a coordinate of a record's box
constexpr MortonKey kAllKeys = (MortonKey{1} << kMortonBits) - 1;

void writeWide(ByteWriter& out, MortonKey v) {
  for (; v >= 128; v >>= 7) out.u8(static_cast<std::uint8_t>(v | 128));
  out.u8(static_cast<std::uint8_t>(v));
}

MortonKey readWide(ByteReader& in) {
  MortonKey v = 0;
  for (int shift = 0; shift < kMortonBits; shift += 7) {
    const std::uint8_t byte = in.u8();
    v |= MortonKey{byte & 127u} << shift;
    if (byte < 128) return v;
  }
  in.fail("a number is too large");
}

// Coordinates differ modulo 2^64, so that any box survives.
std::uint64_t less(std::int64_t a, std::int64_t b) {
  return static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b);
}
std::int64_t plus(std::int64_t a, std::uint64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + b);
}
std::uint64_t signedLess(std::int64_t a, std::int64_t b) { return zigzag(static_cast<std::int64_t>(less(a, b))); }

bool same(const GridBox& a, const GridBox& b) { return a.lo == b.lo && a.hi == b.hi; }
bool someBoxHolds(std::span<const GridBox> boxes, const GridBox& content) {
  return content.empty() || std::any_of(boxes.begin(), boxes.end(), [&](const GridBox& box) {
           return box.contains(content.lo) && box.contains(content.hi);
         });
}

// A record's boxes have coordinates of kBoxBits, in steps of a power of two from the corner of its content.
struct BoxScale {
  std::array<int, 3> shift{};
  explicit BoxScale(const GridBox& content) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      shift[axis] = std::max(0, bitsFor(less(content.hi[i], content.lo[i])) - kBoxBits);
    }
  }
};

// Writes and reads the records of pages that follow each other: each states differences from the one before.
class PageRecordWriter {
 public:
  void write(const DirectoryRecord& r) {
    const MortonKey step = (r.low - low_) & kAllKeys;
    const auto low64 = static_cast<std::uint64_t>(step), high64 = static_cast<std::uint64_t>(step >> 64);
    const int zeros = step == 0 ? 0 : low64 != 0 ? std::countr_zero(low64) : 64 + std::countr_zero(high64);
    out.u8(static_cast<std::uint8_t>(zeros));
    writeWide(out, step >> zeros);
    for (Eigen::Index i = 0; i < 3; ++i) out.varint(signedLess(r.content.lo[i], lo_[i]));
    for (Eigen::Index i = 0; i < 3; ++i) out.varint(less(r.content.hi[i], r.content.lo[i]));
    out.u64(r.checksum);
    out.varint(r.bytes);
    writeBoxes(r);
    low_ = r.low;
    lo_ = r.content.lo;
  }
  ByteWriter out;

 private:
  void writeBoxes(const DirectoryRecord& r) {
    const bool plain = r.boxes.size() == 1 && same(r.boxes[0], r.content);
    out.u8(static_cast<std::uint8_t>(plain ? 0 : r.boxes.size()));
    if (plain) return;
    const BoxScale scale(r.content);
    for (const GridBox& box : r.boxes)
      for (const GridPoint& corner : {box.lo, box.hi})
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const auto i = static_cast<Eigen::Index>(axis);
          out.u8(static_cast<std::uint8_t>(less(corner[i], r.content.lo[i]) >> scale.shift[axis]));
        }
  }
  MortonKey low_ = 0;
  GridPoint lo_ = GridPoint::Zero();
};

class PageRecordReader {
 public:
  explicit PageRecordReader(ByteReader& in) : in_(in) {}
  DirectoryRecord read() {
    DirectoryRecord r;
    const int zeros = in_.u8();
    in_.require(zeros < kMortonBits, "a block lies outside the grid");
    low_ = r.low = (low_ + (readWide(in_) << zeros)) & kAllKeys;
    for (Eigen::Index i = 0; i < 3; ++i)
      r.content.lo[i] = plus(lo_[i], static_cast<std::uint64_t>(unzigzag(in_.varint())));
    for (Eigen::Index i = 0; i < 3; ++i) r.content.hi[i] = plus(r.content.lo[i], in_.varint());
    lo_ = r.content.lo;
    r.checksum = in_.u64();
    r.bytes = in_.varint();
    const std::uint8_t boxes = in_.u8();
    in_.require(boxes <= DirectoryRecord::kMostBoxes && (boxes == 0 || !r.content.empty()), "too many boxes of a page");
    if (boxes == 0) r.boxes = {r.content};
    const BoxScale scale(r.content);
    for (std::uint8_t b = 0; b < boxes; ++b) {
      GridBox& box = r.boxes.emplace_back();
      for (GridPoint* const corner : {&box.lo, &box.hi})
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const auto i = static_cast<Eigen::Index>(axis);
          const std::uint64_t steps = std::uint64_t{in_.u8()} + (corner == &box.hi ? 1 : 0);
          (*corner)[i] = plus(r.content.lo[i], (steps << scale.shift[axis]) - (corner == &box.hi ? 1 : 0));
        }
      box.hi = box.hi.cwiseMin(r.content.hi);
      in_.require(!box.empty(), "a box of a page is empty");
    }
    return r;
  }

 private:
  ByteReader& in_;
  MortonKey low_ = 0;
  GridPoint lo_ = GridPoint::Zero();
};

GridBox blockOf(const TileEntry& e, bool is_long) { return closedBlock(is_long ? BlockKey{} : e.key); }

// Writes and reads the entries of a page.
struct EntryOrder {
  MortonKey next;  // one past the keys of the tile before; at first the lowest key of the page
  int depth = kMortonBits;
  std::uint32_t pack = 0;  // where the tile before ends
  std::uint64_t end = 0;

  int shift(int of_depth) const { return kMortonBits - std::max(depth, of_depth); }
  void pass(const BlockKey& key, const TileLocation& at) {
    next = key.high() + 1;
    depth = key.depth;
    pack = at.pack;
    end = at.offset + at.geometry_bytes + at.appearance_bytes;
  }
};

void writeEntry(ByteWriter& out, const TileEntry& e, const TileLocation& at, bool is_long, EntryOrder& order) {
  if (!is_long) {
    out.u8(static_cast<std::uint8_t>(e.key.depth));
    writeWide(out, (e.key.low - order.next) >> order.shift(e.key.depth));
  }
  const GridBox block = blockOf(e, is_long);
  for (Eigen::Index i = 0; i < 3; ++i) out.varint(signedLess(e.content.lo[i], block.lo[i]));
  for (Eigen::Index i = 0; i < 3; ++i) out.varint(signedLess(block.hi[i], e.content.hi[i]));
  out.u8(e.types);
  out.varint(e.owned);
  out.varint(e.stored - e.owned);
  out.varint(e.isolated);
  out.varint(at.geometry_bytes);
  out.varint(at.appearance_bytes);
  out.varint(e.decoded_bytes);
  const bool follows = order.end > 0 && at.pack == order.pack && at.offset == order.end;
  out.varint(follows ? 0 : std::uint64_t{at.pack} + 1);
  if (!follows) out.varint(at.offset);
  out.u64(at.geometry_checksum);
  out.u64(at.appearance_checksum);
  order.pass(e.key, at);
}

void readEntry(ByteReader& in, TileEntry& e, TileLocation& at, bool is_long, EntryOrder& order) {
  if (!is_long) {
    e.key.depth = in.u8();
    in.require(e.key.depth <= kMortonBits, "a block lies outside the grid");
    const MortonKey gap = readWide(in);
    const int shift = order.shift(e.key.depth);
    in.require(gap <= kAllKeys >> shift, "a block lies outside the grid");
    e.key.low = order.next + (gap << shift);
    in.require(e.key.low <= kAllKeys, "a block lies outside the grid");
    in.require(e.key.high() - e.key.low == BlockKey{0, e.key.depth}.high(), "a block's key is invalid");
  }
  const GridBox block = blockOf(e, is_long);
  for (Eigen::Index i = 0; i < 3; ++i)
    e.content.lo[i] = plus(block.lo[i], static_cast<std::uint64_t>(unzigzag(in.varint())));
  for (Eigen::Index i = 0; i < 3; ++i)
    e.content.hi[i] = static_cast<std::int64_t>(less(block.hi[i], unzigzag(in.varint())));
  e.types = in.u8();
  e.owned = in.varint32();
  const std::uint32_t ghosts = in.varint32();
  in.require(ghosts <= UINT32_MAX - e.owned, "a tile's counts contradict each other");
  e.stored = e.owned + ghosts;
  e.isolated = in.varint32();
  at.geometry_bytes = in.varint32();
  at.appearance_bytes = in.varint32();
  e.decoded_bytes = in.varint();
  const std::uint64_t place = in.varint();
  in.require(place <= std::uint64_t{UINT32_MAX} + 1 && (place > 0 || order.end > 0), "a tile lies nowhere");
  at.pack = place == 0 ? order.pack : static_cast<std::uint32_t>(place - 1);
  at.offset = place == 0 ? order.end : in.varint();
  at.geometry_checksum = in.u64();
  at.appearance_checksum = in.u64();
  order.pass(e.key, at);
}

// At most `most` boxes of the leaves [begin, end). The largest box is halved at its highest bound of blocks.
std::vector<GridBox> boxesOf(const std::vector<TileEntry>& entries, TileId begin, TileId end, std::size_t most) {
  struct Part {
    TileId begin, end;
    GridBox box;
    std::int64_t size() const {
      return box.empty() || end - begin < 2 ? -1 : static_cast<std::int64_t>((box.hi - box.lo).sum());
    }
  };
  const auto part = [&](TileId from, TileId to) {
    Part made{from, to, {}};
    for (TileId t = from; t < to; ++t) made.box.extend(entries[t].content);
    return made;
  };
  std::vector<Part> parts{part(begin, end)};
  while (parts.size() < most) {
    const auto largest =
        std::max_element(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.size() < b.size(); });
    if (largest->size() < 0) break;
    const MortonKey last = entries[largest->end - 1].key.low;
    MortonKey differ = entries[largest->begin].key.low ^ last, bit = 1;
    while (differ >>= 1) bit <<= 1;
    const MortonKey bound = last & ~(bit - 1);
    TileId middle = largest->begin + 1;
    while (entries[middle].key.low < bound) ++middle;
    const Part lower = part(largest->begin, middle), upper = part(middle, largest->end);
    *largest = lower;
    parts.push_back(upper);
  }
  std::vector<GridBox> boxes;
  for (const Part& p : parts)
    if (!p.box.empty()) boxes.push_back(p.box);
  return boxes;
}

// The record of the tiles [begin, end), without its page.
DirectoryRecord recordOf(const DirectoryContents& directory, TileId begin, TileId end, std::size_t most_boxes) {
  DirectoryRecord r;
  r.low = directory.entries[begin].key.low;
  for (TileId t = begin; t < end; ++t) r.content.extend(directory.entries[t].content);
  const TileId leaves_end = directory.long_tile < end ? directory.long_tile : end;
  if (begin < leaves_end) r.boxes = boxesOf(directory.entries, begin, leaves_end, most_boxes);
  // Boxes are stated as steps of a few bits: a content without a size that fits them keeps the one box.
  constexpr std::int64_t kEdge = std::int64_t{1} << 44;
  if (r.boxes.empty() || (r.content.lo.array() < -kEdge).any() || (r.content.hi.array() > kEdge).any())
    r.boxes = {r.content};
  return r;
}

// Reads a page and compares its checksum.
Bytes readPage(const DirectoryRecord& page, const char* kind, std::uint32_t number, const ReadPart& read) {
  Bytes bytes = read(page.at, page.bytes);
  if (checksum(bytes) != page.checksum) throw Damage{page.at, kind + std::to_string(number) + "'s checksum is wrong"};
  return bytes;
}

}  // namespace

Bytes writeDirectory(const DirectoryContents& directory, const DirectoryShape& least,
                     const std::function<void(ByteSpan page)>& use) {
  DirectoryRoot root;
  root.tiles = static_cast<TileId>(directory.entries.size());
  root.long_tile = directory.long_tile;
  root.page_tiles = least.page_tiles;
  root.group_pages = least.group_pages;
  std::size_t group_boxes = DirectoryRecord::kMostBoxes;
  const auto shrink = [&] {
    if (root.group_pages < kUsualGroup)
      root.group_pages *= 2;
    else if (group_boxes > kPageBoxes)
      group_boxes /= 2;
    else
      (root.group_pages < root.page_tiles ? root.group_pages : root.page_tiles) *= 2;
  };
  const auto usualBytes = [&] { return std::size_t{root.group_count()} * (36 + 6 * group_boxes); };
  while (usualBytes() > (root.group_pages < kUsualGroup ? kSmallRootBytes : kMaxRootBytes)) shrink();
  const auto leafPage = [&](std::uint32_t page) {
    ByteWriter bytes;
    EntryOrder order{directory.entries[root.pageBegin(page)].key.low};
    for (TileId t = root.pageBegin(page); t < root.pageEnd(page); ++t)
      writeEntry(bytes, directory.entries[t], directory.locations[t], t == directory.long_tile, order);
    return bytes.take();
  };
  Bytes encoded;
  // Passes all groups to `take` and returns false if the root is too large.
  const auto writeGroups = [&](const auto& take) {
    PageRecordWriter records;
    for (std::uint32_t group = 0; group < root.group_count(); ++group) {
      const std::uint32_t begin = root.groupBegin(group), end = root.groupEnd(group);
      PageRecordWriter inner;
      Bytes pages;
      for (std::uint32_t page = begin; page < end; ++page) {
        const Bytes leaves = leafPage(page);
        DirectoryRecord one = recordOf(directory, root.pageBegin(page), root.pageEnd(page), kPageBoxes);
        one.checksum = checksum(leaves);
        one.bytes = leaves.size();
        inner.write(one);
        pages.insert(pages.end(), leaves.begin(), leaves.end());
      }
      DirectoryRecord whole = recordOf(directory, root.pageBegin(begin), root.pageEnd(end - 1), group_boxes);
      whole.checksum = checksum(inner.out.bytes());
      whole.bytes = inner.out.size();
      records.write(whole);
      records.out.varint(pages.size());
      take(inner.out.bytes());
      take(pages);
    }
    encoded = records.out.take();
    return kRootHeaderBytes + encoded.size() <= kMaxRootBytes;
  };
  // Records vary in size: a trial is needed only near the limit.
  while (2 * usualBytes() > kMaxRootBytes && !writeGroups([](ByteSpan) {})) shrink();
  ByteWriter header;
  writeMagic(header, kDirectoryMagic);
  header.u32(0);
  use(header.bytes());
  writeGroups(use);
  ByteWriter out;
  out.u32(root.tiles);
  out.u32(root.long_tile);
  out.u32(root.page_tiles);
  out.u32(root.group_pages);
  out.append(encoded);
  return out.take();
}

DirectoryRoot decodeDirectoryRoot(ByteSpan bytes, std::uint32_t version, std::uint64_t file_bytes) {
  ByteReader in(bytes);
  DirectoryRoot root;
  root.version = version;
  root.tiles = in.u32();
  root.long_tile = in.u32();
  root.page_tiles = in.u32();
  root.group_pages = in.u32();
  in.require(std::has_single_bit(root.page_tiles) && root.page_tiles <= kMostPageItems &&
                 std::has_single_bit(root.group_pages) && root.group_pages <= kMostPageItems,
             "the size of a page is out of range");
  in.require(root.long_tile == kNoTile || root.long_tile + 1 == root.tiles, "the long-segment tile is not the last");
  in.require(bytes.size() <= kMaxRootBytes, "the root is too large");
  if (version == 2) {
    readOldGroups(in, root, file_bytes);
  } else {
    in.require(root.tiles <= file_bytes / kLeastEntryBytes && root.group_count() <= in.left() / kLeastRecordBytes,
               "the number of tiles does not fit the file");
    PageRecordReader records(in);
    std::uint64_t at = kDirectoryHeaderBytes;
    for (std::uint32_t group = 0; group < root.group_count(); ++group) {
      DirectoryRecord& r = root.groups.emplace_back(records.read());
      const std::uint64_t pages = in.varint(), left = file_bytes - at;
      in.require(r.bytes <= left && pages <= left - r.bytes, "a page lies outside the file");
      const std::uint32_t first = root.groupBegin(group), end = root.groupEnd(group);
      in.require(end - first <= r.bytes / kLeastRecordBytes &&
                     root.pageEnd(end - 1) - root.pageBegin(first) <= pages / kLeastEntryBytes,
                 "a page has too few bytes");
      r.at = at;
      r.bytes_with_pages = r.bytes + pages;
      at += r.bytes_with_pages;
    }
    in.require(in.left() == 0 && at == file_bytes, "the number of tiles does not fit the file");
  }
  for (std::uint32_t group = 1; group < root.groups.size(); ++group)
    in.require(
        root.pageBegin(root.groupBegin(group)) == root.long_tile || root.groups[group].low > root.groups[group - 1].low,
        "the pages are out of order");
  return root;
}

DirectoryGroup decodeDirectoryGroup(const DirectoryRoot& root, std::uint32_t group, const ReadPart& read) {
  const std::uint32_t begin = root.groupBegin(group), end = root.groupEnd(group);
  const DirectoryRecord& stated = root.groups[group];
  const Bytes bytes = readPage(stated, "inner page ", group, read);
  ByteReader in(bytes);
  DirectoryGroup found;
  try {
    GridBox content;
    PageRecordReader records(in);
    std::uint64_t at = stated.at + stated.bytes;
    for (std::uint32_t page = begin; page < end; ++page) {
      DirectoryRecord r = root.version == 2 ? readOldRecord(in, root, page) : records.read();
      content.extend(r.content);
      in.require(page == begin                            ? r.low == stated.low
                 : root.pageBegin(page) == root.long_tile ? true
                                                          : r.low > found.back().low,
                 "the pages are out of order");
      if (root.version > 2) {
        const std::uint64_t left = stated.at + stated.bytes_with_pages - at;
        in.require(r.bytes <= left && root.pageEnd(page) - root.pageBegin(page) <= r.bytes / kLeastEntryBytes,
                   "a page lies outside its group");
        r.at = at;
        at += r.bytes;
      }
      found.push_back(std::move(r));
    }
    in.require(in.left() == 0 && (root.version == 2 || at == stated.at + stated.bytes_with_pages),
               "bytes beyond the end of an inner page");
    const bool next_has_leaves = group + 1 < root.groups.size() && root.pageBegin(end) < root.leaf_count();
    in.require(!next_has_leaves || found.back().low < root.groups[group + 1].low, "the pages are out of order");
    in.require(same(content, stated.content), "the content of an inner page differs from the root");
  } catch (const Damage& damage) {
    throw Damage{stated.at + damage.offset, damage.what};
  }
  return found;
}

DirectoryPage decodeDirectoryPage(const DirectoryRoot& root, const DirectoryGroup& group, std::uint32_t page,
                                  const ReadPart& read) {
  const TileId begin = root.pageBegin(page), end = root.pageEnd(page);
  const std::uint32_t in_group = page % root.group_pages;
  const DirectoryRecord &stated = group[in_group], &of_group = root.groups[page / root.group_pages];
  const Bytes bytes = readPage(stated, "page ", page, read);
  DirectoryPage found;
  found.entries.resize(end - begin);
  found.locations.resize(end - begin);
  ByteReader in(bytes);
  try {
    GridBox content;
    EntryOrder order{stated.low};
    for (TileId t = begin; t < end; ++t) {
      TileEntry& e = found.entries[t - begin];
      if (root.version == 2)
        readOldEntry(in, e, found.locations[t - begin]);
      else
        readEntry(in, e, found.locations[t - begin], t == root.long_tile, order);
      in.require(e.owned <= e.stored && e.isolated <= e.owned && e.stored > 0, "a tile's counts contradict each other");
      content.extend(e.content);
      in.require(t == begin ? e.key.low == stated.low
                            : t == root.long_tile || e.key.low > found.entries[t - begin - 1].key.high(),
                 "the leaves are out of order");
      in.require(
          t == root.long_tile || (someBoxHolds(stated.boxes, e.content) && someBoxHolds(of_group.boxes, e.content)),
          "a tile lies outside the boxes of its page");
    }
    in.require(in.left() == 0, "bytes beyond the end of a page");
    if (end < root.leaf_count()) {
      const MortonKey next =
          in_group + 1 < group.size() ? group[in_group + 1].low : root.groups[page / root.group_pages + 1].low;
      in.require(found.entries.back().key.high() < next, "the leaves are out of order");
    }
    in.require(same(content, stated.content), "the content of a page differs from its inner page");
  } catch (const Damage& damage) {
    throw Damage{stated.at + damage.offset, damage.what};
  }
  return found;
}

DirectoryContents decodeDirectory(ByteSpan root_bytes, std::uint32_t version, std::uint64_t file_bytes,
                                  const ReadPart& read) {
  const DirectoryRoot root = decodeDirectoryRoot(root_bytes, version, file_bytes);
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
