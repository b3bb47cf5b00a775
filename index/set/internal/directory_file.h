// directory.bin: position and description of every tile, in pages. FORMAT.md specifies the bytes. Decoders throw Damage
// and never read past their input.
#pragma once

#include "index/set/internal/set_files.h"
#include "index/set/tile_store.h"

#include <algorithm>
#include <vector>

namespace filiform::internal {

inline constexpr std::size_t kMaxRootBytes = 16384;

struct DirectoryContents {
  Grid grid;
  std::uint32_t capacity = 0;
  TileId long_tile = kNoTile;
  std::vector<TileEntry> entries;
  std::vector<TileLocation> locations;
};
Bytes encodeDirectory(const DirectoryContents& directory);
// Decodes all pages in order.
DirectoryContents decodeDirectory(std::uint64_t file_bytes, const ReadPart& read);

// The root page: what is known of the other pages without reading them.
struct DirectoryRoot {
  struct Page {
    MortonKey low = 0;  // key of its first tile
    GridBox content;    // box of its tiles' content
    std::uint64_t checksum = 0;
  };
  Grid grid;
  std::uint32_t capacity = 0;
  TileId tiles = 0, page_tiles = 0, long_tile = kNoTile;
  std::vector<Page> pages;

  TileId leaf_count() const { return tiles - (long_tile != kNoTile ? 1 : 0); }
  TileId pageBegin(std::uint32_t page) const { return page * page_tiles; }
  TileId pageEnd(std::uint32_t page) const {
    return static_cast<TileId>(std::min<std::uint64_t>(tiles, (std::uint64_t{page} + 1) * page_tiles));
  }
};
// Checks the root page and the order of its pages.
DirectoryRoot decodeDirectoryRoot(std::uint64_t file_bytes, const ReadPart& read);
struct DirectoryPage {
  std::vector<TileEntry> entries;
  std::vector<TileLocation> locations;
};
// Checks the page, the order of its leaves, and its agreement with the root page.
DirectoryPage decodeDirectoryPage(const DirectoryRoot& root, std::uint32_t page, const ReadPart& read);
// Reads TileEntry::decoded_bytes of a page's tiles; checks only the checksum. Overwrites `scratch`.
void readDecodedBytes(const DirectoryRoot& root, std::uint32_t page, const ReadPart& read, Bytes& scratch,
                      std::vector<std::uint64_t>& decoded_bytes);

}  // namespace filiform::internal
