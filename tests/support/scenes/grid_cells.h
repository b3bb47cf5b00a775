// The oracle of the tiler: holds all cells of a stream, snapped to the grid, and finds their tiles by sorting.
// Immutable after construction.
#pragma once

#include "index/cell/cell.h"
#include "index/set/tile_store.h"
#include "index/tile/tile.h"

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

namespace filiform::internal {

enum class SampleKind : std::uint8_t { root, link, isolated };  // link: owns the segment to its parent

class GridCells {
 public:
  // Reads the stream to its end. Throws InputError for more samples than 32 bits can count, and if `cancel` (may be
  // null) becomes true; UsageError for a cell whose arrays differ in length.
  GridCells(CellStream& stream, const Grid& grid, const std::atomic<bool>* cancel);

  const Grid& grid() const { return grid_; }
  std::uint32_t cell_count() const { return static_cast<std::uint32_t>(begin_.size() - 1); }
  std::uint32_t sample_count() const { return begin_.back(); }
  // Samples of a cell are begin(cell) .. begin(cell + 1) - 1, in rank order.
  std::uint32_t begin(std::uint32_t cell) const { return begin_[cell]; }
  std::uint32_t cellOf(std::uint32_t sample) const;  // O(log cells)

  SampleKind kind(std::uint32_t sample) const { return kinds_[sample]; }
  bool isSegment(std::uint32_t sample) const { return kinds_[sample] != SampleKind::root; }
  const GridPoint& position(std::uint32_t sample) const { return positions_[sample]; }
  // The sample at the other end of the segment: the parent, or the sample itself if isolated. Requires
  // isSegment(sample).
  std::uint32_t other(std::uint32_t sample, std::uint32_t cell) const {
    return kinds_[sample] == SampleKind::link ? begin_[cell] + parents_[sample] : sample;
  }
  float radius_um(std::uint32_t sample) const { return radii_um_[sample]; }
  std::uint16_t type(std::uint32_t sample) const { return types_[sample]; }
  StoredSegment segment(std::uint32_t sample, std::uint32_t cell, bool owned) const;

  std::uint64_t digest(std::uint32_t cell) const { return digests_[cell]; }
  const std::vector<CellRecord>& records() const { return records_; }
  // Everything except `tiles`.
  CellDetail detail(std::uint32_t cell) const;

 private:
  void take(Cell& cell);

  Grid grid_;
  std::vector<std::uint32_t> begin_{0};
  std::vector<GridPoint> positions_;
  std::vector<std::uint32_t> parents_;  // rank in the cell
  std::vector<SampleKind> kinds_;
  std::vector<float> radii_um_;
  std::vector<std::uint16_t> types_;
  std::vector<std::int64_t> sample_ids_;
  std::vector<std::vector<std::uint32_t>> block_starts_;
  std::vector<std::uint64_t> digests_;
  std::vector<CellRecord> records_;
  std::vector<std::string> given_names_;  // used only while cells are read
};

// The segments of each tile.
struct Placement {
  struct Stored {
    std::uint32_t sample;  // the child, as numbered by GridCells
    std::uint32_t tile;    // combined with kOwned
    static constexpr std::uint32_t kOwned = std::uint32_t{1} << 31;
    bool owned() const { return (tile & kOwned) != 0; }
  };
  std::vector<BlockKey> leaves;      // leaves with segments, ascending
  bool has_long = false;             // true: one more tile comes after the leaves
  std::vector<std::uint64_t> begin;  // of each tile in `stored`, and the end
  std::vector<Stored> stored;        // by tile, then by sample

  TileId tile_count() const { return static_cast<TileId>(begin.size() - 1); }
  bool isLong(TileId tile) const { return has_long && tile + 1 == tile_count(); }
  BlockKey key(TileId tile) const { return isLong(tile) ? BlockKey{} : leaves[tile]; }
};

// Throws Interrupted. O(n log n).
Placement place(const GridCells& cells, std::uint32_t capacity, const std::atomic<bool>* cancel);

std::shared_ptr<const Tile> buildTile(const GridCells& cells, const Placement& placement, TileId tile);
TileAppearance buildAppearance(const GridCells& cells, const Placement& placement, TileId tile);
// For each cell, the tiles that own its segments, ascending.
std::vector<std::vector<TileId>> owningTiles(const GridCells& cells, const Placement& placement);

}  // namespace filiform::internal
