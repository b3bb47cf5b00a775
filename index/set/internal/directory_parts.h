// The parts of a directory in memory: its root, inner pages and leaf pages. Thread rule: plain values.
#pragma once

#include "index/file/internal/set_files.h"
#include "index/set/tile_store.h"

#include <algorithm>
#include <vector>

namespace filiform::internal {

inline constexpr std::size_t kDirectoryHeaderBytes = 16;  // of the file

// What is known of a page without reading it.
struct DirectoryRecord {
  static constexpr std::size_t kMostBoxes = 8;

  MortonKey low = 0;  // key of its first tile
  GridBox content;    // box of its tiles' content
  std::uint64_t checksum = 0;
  std::uint64_t at = 0, bytes = 0;  // in the file
  // Of an inner page: its bytes and those of its leaf pages, which follow. 0 in version 2: they lie elsewhere.
  std::uint64_t bytes_with_pages = 0;
  std::vector<GridBox> boxes;  // 1 to kMostBoxes: each leaf's content lies in one of them
};

struct DirectoryRoot {
  std::uint32_t version = kFormatVersion;
  TileId tiles = 0, page_tiles = 1, long_tile = kNoTile;
  std::uint32_t group_pages = 1;        // leaf pages of an inner page
  std::vector<DirectoryRecord> groups;  // the inner pages

  TileId leaf_count() const { return tiles - (long_tile != kNoTile ? 1 : 0); }
  std::uint32_t page_count() const {
    return static_cast<std::uint32_t>((std::uint64_t{tiles} + page_tiles - 1) / page_tiles);
  }
  std::uint32_t group_count() const {
    return static_cast<std::uint32_t>((std::uint64_t{page_count()} + group_pages - 1) / group_pages);
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
using DirectoryGroup = std::vector<DirectoryRecord>;  // the leaf pages of an inner page
struct DirectoryPage {
  std::vector<TileEntry> entries;
  std::vector<TileLocation> locations;
};

}  // namespace filiform::internal
