// CellsReader: the table of cells of an open set. It reads pages when they are first needed, and keeps them.
#pragma once

#include "index/file/internal/read_once.h"
#include "index/set/internal/cells_file.h"
#include "index/set/internal/revision.h"

#include <memory>
#include <optional>
#include <string>

namespace filiform::internal {

// Thread rule: internally synchronised. Members throw CorruptSet, IoError, and std::out_of_range if the cell does not
// exist.
class CellsReader {
 public:
  explicit CellsReader(const Revision& revision) : revision_(revision) {}  // reads nothing

  // Each reads the root and a page at their first use.
  const CellRecord& record(std::uint32_t id) const;
  std::optional<std::uint32_t> find(const std::string& name) const;  // the lowest id; reads up to two pages of names
  CellDetail detail(std::uint32_t id, TileId tile_count) const;      // also reads the detail
  std::vector<TileId> tiles(std::uint32_t id, TileId tile_count) const;  // also reads the detail
  std::uint64_t digest(std::uint32_t id) const { return page(id).digests[id % kCellsOfPage]; }
  Bytes encodedDetail(std::uint32_t id) const;
  // Reads all pages, one after the other, and compares their sums with the manifest. Keeps nothing.
  void check() const;

 private:
  using Pages = std::unique_ptr<ReadOnce<CellPage>[]>;
  struct Table {
    CellsRoot root;
    Pages records;
    std::unique_ptr<ReadOnce<NamePage>[]> names;
  };
  template <typename Decode>  // decode(bytes of the detail, record) gives an optional; none: contradicts the record
  auto decodedDetail(std::uint32_t id, Decode decode) const;
  const Table& table() const;
  const CellPage& page(std::uint32_t id) const;
  CellPage readRecords(const CellsRoot& root, std::uint32_t page) const;
  NamePage readNames(const CellsRoot& root, std::uint32_t page) const;

  const Revision& revision_;
  mutable ReadOnce<Table> table_;
};

}  // namespace filiform::internal
