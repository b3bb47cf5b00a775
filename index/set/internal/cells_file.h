// cells.bin: the details of the cells, their records in pages by id, and their names in pages by name. A root at the
// end of the file lists the pages. FORMAT.md specifies the bytes. Decoders throw Damage and never read past their
// input.
#pragma once

#include "index/file/internal/set_files.h"
#include "index/set/tile_store.h"

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace filiform::internal {

inline constexpr std::uint32_t kCellsOfPage = 256;
inline constexpr std::size_t kCellsHeaderBytes = 16, kCellRecordBytes = 128;

struct DetailPlace {
  std::uint64_t offset, bytes, checksum;  // offset in the file
};
struct CellPagePlace {
  std::uint64_t offset, bytes, checksum;
};

// What is written of the cells; the three have a value for each cell.
struct CellColumns {
  const std::vector<CellRecord>& records;
  const std::vector<std::uint64_t>& digests;
  const std::vector<DetailPlace>& details;
};
Bytes cellsHeader();  // the beginning of the file; the details follow
// Passes the pages to `use`, in the order of the file, the first at offset `at`. Returns the root, which follows.
Bytes writeCellPages(const CellColumns& cells, std::uint64_t at, const std::function<void(ByteSpan page)>& use);

struct CellsRoot {
  std::uint32_t cells = 0, named = 0;  // named: not removed
  std::vector<CellPagePlace> records, names;
  std::vector<std::string> first_names;  // of each page of names
};
CellsRoot decodeCellsRoot(ByteSpan root, std::uint64_t file_bytes);
std::uint32_t cellsOfPage(std::uint32_t cells, std::uint32_t page);  // of all `cells`

struct CellPage {
  std::vector<CellRecord> records;
  std::vector<std::uint64_t> digests;
  std::vector<DetailPlace> details;
};
CellPage decodeCellPage(ByteSpan bytes, std::uint32_t cells, std::uint64_t file_bytes);
using NamePage = std::vector<std::pair<std::string, std::uint32_t>>;  // names with ids, ascending
NamePage decodeNamePage(const CellsRoot& root, std::uint32_t page, ByteSpan bytes);

Bytes encodeDetail(const CellDetail& detail);
CellDetail decodeDetail(ByteSpan bytes, std::uint64_t samples);
std::vector<TileId> decodeTiles(ByteSpan detail);  // CellDetail::tiles; the bytes behind them are not looked at
// The detail with other tiles. Throws Damage. O(bytes).
Bytes withTiles(ByteSpan detail, const std::function<void(std::vector<TileId>& tiles)>& change);

}  // namespace filiform::internal
