// The directory: position and description of every tile, in pages. Its root lies in the manifest, the pages in
// directory.bin: inner pages of page records, then leaf pages of tiles. FORMAT.md specifies the bytes. Decoders throw
// Damage and never read past their input.
#pragma once

#include "index/file/internal/set_files.h"
#include "index/set/tile_store.h"

#include <algorithm>
#include <functional>
#include <vector>

namespace filiform::internal {

inline constexpr std::size_t kMaxRootBytes = 16384;

struct DirectoryContents {
  TileId long_tile = kNoTile;
  std::vector<TileEntry> entries;
  std::vector<TileLocation> locations;
};
// Passes the file's bytes to `use`, one page after another, and returns the root. Leaf pages have `page_tiles` tiles,
// inner pages as many leaf pages. Both numbers are doubled until the root fits kMaxRootBytes.
Bytes writeDirectory(const DirectoryContents& directory, std::uint32_t page_tiles,
                     const std::function<void(ByteSpan page)>& use);
// Decodes all pages in order.
DirectoryContents decodeDirectory(ByteSpan root, std::uint64_t file_bytes, const ReadPart& read);

// What is known of a page without reading it.
struct DirectoryRecord {
  MortonKey low = 0;  // key of its first tile
  GridBox content;    // box of its tiles' content
  std::uint64_t checksum = 0;
};

struct DirectoryRoot {
  TileId tiles = 0, page_tiles = 1, long_tile = kNoTile;
  std::uint32_t group_pages = 1;        // leaf pages of an inner page
  std::vector<DirectoryRecord> groups;  // the inner pages

  TileId leaf_count() const { return tiles - (long_tile != kNoTile ? 1 : 0); }
  std::uint32_t page_count() const {
    return static_cast<std::uint32_t>((std::uint64_t{tiles} + page_tiles - 1) / page_tiles);
  }
  TileId pageBegin(std::uint32_t page) const { return page * page_tiles; }
  TileId pageEnd(std::uint32_t page) const {
    return static_cast<TileId>(std::min<std::uint64_t>(tiles, (std::uint64_t{page} + 1) * page_tiles));
  }
  std::uint32_t groupBegin(std::uint32_t group) const { return group * group_pages; }  // a page
  std::uint32_t groupEnd(std::uint32_t group) const {
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(page_count(), (std::uint64_t{group} + 1) * group_pages));
  }
};
// Checks the root and the order of its inner pages. `file_bytes`: size of directory.bin.
DirectoryRoot decodeDirectoryRoot(ByteSpan root, std::uint64_t file_bytes);
// An inner page: the records of its leaf pages. Checks the page, its order, and its agreement with the root.
using DirectoryGroup = std::vector<DirectoryRecord>;
DirectoryGroup decodeDirectoryGroup(const DirectoryRoot& root, std::uint32_t group, const ReadPart& read);
struct DirectoryPage {
  std::vector<TileEntry> entries;
  std::vector<TileLocation> locations;
};
// A leaf page; `group` is the inner page that lists it. Checks the page, the order of its leaves, and its agreement
// with the inner page.
DirectoryPage decodeDirectoryPage(const DirectoryRoot& root, const DirectoryGroup& group, std::uint32_t page,
                                  const ReadPart& read);

}  // namespace filiform::internal
