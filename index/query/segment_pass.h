// All segments of a set, or of some cells or a box, in one pass: each tile is read and decoded once.
//
//   double length_um = 0;
//   forEachSegment(*set, {}, [&](TileId, std::span<const PassedSegment> segments) {
//     for (const PassedSegment& s : segments) length_um += set->grid().toWorld(s.child - s.parent).norm();
//   });
//
// Thread rule: any thread but the haptic one; `visit` runs on the calling thread.
#pragma once

#include "index/set/tile_store.h"
#include "index/tile/passed_segment.h"

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace filiform {

struct SegmentPass {
  bool with_appearance = false;  // also read radii and types
  // Only segments that meet this closed box. Grid::snap() gives its corners.
  std::optional<GridBox> box{};
  std::optional<std::vector<std::uint32_t>> cells{};  // only segments of these cells; each below cell_count()
  unsigned threads = 1;                               // that decode tiles of a set in a folder, at least 1
  std::function<void()> check{};                      // called before each tile; its exceptions end the pass
};

// Calls visit(tile, segments) for each tile that owns such segments. Each segment comes once, from the tile that owns
// it. Tiles ascend by id. With a box, the tiles that the box meets come first; then those, ascending, that own a
// segment of the box without meeting it. A tile's segments ascend by id; the span is valid during the call. Neither
// threads nor where the set is change what is visited, or the order. From a set at an address, up to
// TilesAhead::kRemoteTiles tiles are read together. Memory: these tiles, or twice as many as threads; one tile's
// segments; a bit a tile and a cell. Throws what the store throws; exceptions of `visit` and `check` propagate.
// O(segments of the tiles).
void forEachSegment(const TileStore& store, const SegmentPass& pass,
                    const std::function<void(TileId tile, std::span<const PassedSegment> segments)>& visit);

// The same pass, where the caller takes one tile after the other.
// Thread rule: thread-compatible.
class SegmentReader {
 public:
  // Reads nothing. The store must outlive this object.
  SegmentReader(const TileStore& store, SegmentPass pass);
  ~SegmentReader();

  // The segments of the next tile that has some, until the next call; empty after the last. Throws as
  // forEachSegment(); no call may follow.
  std::span<const PassedSegment> next();
  TileId tile() const;  // of these segments

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The tiles that own segments of these cells, ascending. Reads the list of each cell, from a set at an address several
// together. For all cells of the set: all tiles, without reading. Throws CorruptSet, IoError.
std::vector<TileId> tilesOf(const TileStore& store, std::span<const std::uint32_t> cells);

}  // namespace filiform
