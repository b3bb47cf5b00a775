// The directory of format version 2: how its records and entries differ. FORMAT.md specifies the bytes.
#pragma once

#include "index/set/internal/directory_parts.h"

namespace filiform::internal {

inline constexpr std::size_t kOldRecordBytes = 72, kOldEntryBytes = 128;

inline DirectoryRecord readPlainRecord(ByteReader& in) {
  DirectoryRecord r;
  r.low = in.key();
  r.content = in.box();
  r.checksum = in.u64();
  r.boxes = {r.content};
  return r;
}

// Decodes the records of the inner pages from the rest of the root, whose first four fields are known. Throws Damage.
inline void readOldGroups(ByteReader& in, DirectoryRoot& root, std::uint64_t file_bytes) {
  const std::uint64_t pages = root.page_count(), groups = root.group_count();
  in.require(in.left() == groups * kOldRecordBytes && file_bytes == kDirectoryHeaderBytes + pages * kOldRecordBytes +
                                                                        std::uint64_t{root.tiles} * kOldEntryBytes,
             "the number of tiles does not fit the file");
  for (std::uint32_t group = 0; group < groups; ++group) {
    DirectoryRecord& r = root.groups.emplace_back(readPlainRecord(in));
    r.at = kDirectoryHeaderBytes + std::uint64_t{root.groupBegin(group)} * kOldRecordBytes;
    r.bytes = (root.groupEnd(group) - root.groupBegin(group)) * kOldRecordBytes;
  }
}

// Reads the record of a leaf page. Throws Damage.
inline DirectoryRecord readOldRecord(ByteReader& in, const DirectoryRoot& root, std::uint32_t page) {
  DirectoryRecord r = readPlainRecord(in);
  r.at = kDirectoryHeaderBytes + std::uint64_t{root.page_count()} * kOldRecordBytes +
         std::uint64_t{root.pageBegin(page)} * kOldEntryBytes;
  r.bytes = std::uint64_t{root.pageEnd(page) - root.pageBegin(page)} * kOldEntryBytes;
  return r;
}

// Reads the entry of a tile, in whole words: a page has hundreds. Throws Damage.
inline void readOldEntry(ByteReader& in, TileEntry& e, TileLocation& at) {
  const std::uint8_t* const bytes = in.take(kOldEntryBytes).data();
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
  at.geometry_bytes = high32(80);
  at.appearance_bytes = low32(88);
  in.require(high32(88) == 1, "tiles that are encoded together");
  e.decoded_bytes = u64(96);
  at.offset = u64(104);
  at.geometry_checksum = u64(112);
  at.appearance_checksum = u64(120);
}

}  // namespace filiform::internal
