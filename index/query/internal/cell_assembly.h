// CellAssembly: puts a cell together from the segments that its tiles own, in any order of the tiles. Thread rule:
// thread-compatible.
#pragma once

#include "index/query/cell_graph.h"
#include "index/tile/passed_segment.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace filiform::internal {

class CellAssembly {
 public:
  // `detail`: that of the cell. The store must outlive this object. Memory follows what the tiles hold, not what the
  // record states: beyond kFirstRoom samples, at most kRoomASegment samples for each segment that has arrived.
  CellAssembly(const TileStore& store, std::uint32_t cell, CellDetail detail, bool with_appearance);

  const std::vector<TileId>& tiles() const { return detail_.tiles; }  // that own a segment of the cell, ascending
  // Adds what a tile owns of the cell, or notes the tile for endTiles(). Throws CorruptSet.
  void add(TileId tile, std::span<const PassedSegment> segments);
  // Call it after all tiles. Returns those to add() again. Throws CorruptSet.
  const std::vector<TileId>& endTiles();
  // Throws CorruptSet. Without appearance, reads the tiles of somata.
  CellGraph finish();

 private:
  static constexpr std::uint64_t kFirstRoom = std::uint64_t{1} << 20, kRoomASegment = 8;

  [[noreturn]] void fail(const std::string& why) const;
  bool takes(std::span<const PassedSegment> segments);
  void place(std::uint32_t rank, const GridPoint& p);
  void link(const PassedSegment& segment);
  void makeRoom(std::uint64_t room);
  std::uint64_t most() const;
  void addOddRadii();
  CellSomata somata() const;

  const TileStore& store_;
  const std::uint32_t cell_;
  CellDetail detail_;
  CellGraph graph_;
  const bool with_appearance_;
  bool has_loops_;
  std::uint64_t samples_, segments_, room_ = 0, arrived_ = 0;  // arrived: segments in tiles
  std::vector<std::uint8_t> placed_, linked_;
  std::vector<TileId> later_;
};

}  // namespace filiform::internal
