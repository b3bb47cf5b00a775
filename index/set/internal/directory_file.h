// The directory: position and description of every tile, in pages. Its root lies in the manifest, the pages in
// directory.bin: each inner page of page records is followed by the leaf pages that it lists. FORMAT.md specifies the
// bytes. Decoders read versions 2 and 3. They throw Damage and never read past their input.
#pragma once

#include "index/set/internal/directory_parts.h"

#include <functional>
#include <vector>

namespace filiform::internal {

inline constexpr std::size_t kMaxRootBytes = std::size_t{256} << 10;

struct DirectoryContents {
  TileId long_tile = kNoTile;
  std::vector<TileEntry> entries;
  std::vector<TileLocation> locations;
};
// Tiles of a leaf page, and leaf pages of an inner page: powers of two.
struct DirectoryShape {
  std::uint32_t page_tiles = 64, group_pages = 1;
};
// Passes the file's bytes to `use`, one page after another, and returns the root. `least` is doubled until the root has
// a fitting size.
Bytes writeDirectory(const DirectoryContents& directory, const DirectoryShape& least,
                     const std::function<void(ByteSpan page)>& use);
// Decodes all pages in order. `version`: of the set.
DirectoryContents decodeDirectory(ByteSpan root, std::uint32_t version, std::uint64_t file_bytes, const ReadPart& read);

// Checks the root and the order of its inner pages. `file_bytes`: size of directory.bin.
DirectoryRoot decodeDirectoryRoot(ByteSpan root, std::uint32_t version, std::uint64_t file_bytes);
// An inner page: the records of its leaf pages. Checks the page, its order, and its agreement with the root.
DirectoryGroup decodeDirectoryGroup(const DirectoryRoot& root, std::uint32_t group, const ReadPart& read);
// A leaf page; `group` is the inner page that lists it. Checks the page, the order of its leaves, and its agreement
// with the inner page and the root.
DirectoryPage decodeDirectoryPage(const DirectoryRoot& root, const DirectoryGroup& group, std::uint32_t page,
                                  const ReadPart& read);

}  // namespace filiform::internal
