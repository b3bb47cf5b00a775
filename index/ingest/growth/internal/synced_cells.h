// SyncedCells: compares a stream of cells with a set, and passes on the cells that the set does not hold.
#pragma once

#include "index/attributes/cell_attributes.h"
#include "index/cell/cell.h"
#include "index/ingest/growth/sync_fate.h"
#include "index/set/tile_set.h"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

namespace filiform::internal {

// A cell of the set is equal to one of the stream if source, digest, counts and box are: the box differs if the same
// bytes were read in another unit. Thread rule: as CellStream.
class SyncedCells final : public CellStream {
 public:
  SyncedCells(CellStream& cells, const TileSet& base);

  // True if next() has a cell to pass on. Reads up to this cell.
  bool any();
  bool next(Cell& cell) override;

  // After the stream's end. Decides what becomes of the cells of the set that the stream did not have. A cell is held
  // if its source is one of `unusable`, or lies in it: it stays, since its file cannot be used now, also if the stream
  // had another cell of an equal source. Others of a source that the stream had are replaced; others are gone, and stay
  // unless `remove`.
  void finish(const std::vector<std::string>& unusable, bool remove);
  // After finish():
  const SyncCounts& counts() const { return counts_; }
  std::map<std::string, SyncFate> fates() const;                          // by source
  const std::vector<bool>& removed() const { return removed_; }           // by cell of the set
  const std::vector<std::uint32_t>& staying() const { return staying_; }  // cells that are gone or held, and stay
  // The names of all cells as one ingest gives them, by id: those of the set, then those passed on. Empty for removed
  // ones.
  std::vector<std::string> names() const;
  // The attributes of a cell, by the same ids. `added`: the attributes of the cells passed on. What the stream states
  // comes first; what only the set has stays.
  std::vector<CellAttribute> attributes(std::uint32_t id, const CellAttributes& base,
                                        const CellAttributes* added) const;

 private:
  static constexpr std::uint32_t kNoCell = UINT32_MAX;
  struct Passed {
    std::string source, name;  // name: the given one
    std::uint64_t digest;
    std::uint32_t replaces;  // cell of the set
  };
  std::optional<std::uint32_t> takeEqual(const Cell& cell);
  bool isEqual(std::uint32_t id, const Cell& cell) const;

  CellStream& cells_;
  const TileSet& base_;
  std::unordered_map<std::string, std::vector<std::uint32_t>> open_;  // by source: cells of the set not found yet
  std::map<std::string, SyncFate> fates_;
  std::optional<Cell> waiting_;
  std::vector<Passed> passed_;
  std::vector<bool> equal_, removed_;                                         // by cell of the set
  std::unordered_map<std::uint32_t, std::string> given_;                      // names of equal cells
  std::unordered_map<std::uint32_t, std::vector<CellAttribute>> attributes_;  // of equal cells
  std::vector<std::uint32_t> staying_;
  SyncCounts counts_;
};

}  // namespace filiform::internal
