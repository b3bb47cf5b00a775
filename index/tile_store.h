// A set of tiles, wherever it lies: on disk (tile_set.h) or built in memory for a small scene (memory_tiles.h). Search,
// residency, export and navigation know only this. Thread rule: internally synchronised; any thread but the haptic one
// may load.
#pragma once

#include "index/cell.h"
#include "index/leaf_index.h"
#include "index/tile.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

struct TileEntry {  // what the directory says of a tile
  CellKey key;
  GridBox content;                  // stored segments, clipped to the closed cell; not clipped in the long-segment tile
  std::uint32_t owned = 0;          // segments owned, isolated ones included
  std::uint32_t stored = 0;         // owned + ghosts
  std::uint32_t isolated = 0;       // of the owned: zero-length stand-ins of isolated samples
  std::uint64_t decoded_bytes = 0;  // Tile::bytes() after loading
};

struct CellRecord {
  std::string name, source;
  std::uint64_t samples = 0, segments = 0, isolated = 0,
                roots = 0;  // roots: samples without parent, isolated ones included
  GridBox bounds;
};

struct CellDetail {
  struct Root {
    std::uint32_t rank;
    float radius_um;
    std::uint16_t type;
  };
  std::vector<TileId> tiles;                // ascending: every tile that owns one of its segments
  std::vector<std::int64_t> sample_ids;     // by rank
  std::vector<Root> roots;                  // ascending rank: attributes that no segment carries
  std::vector<std::uint32_t> block_starts;  // as in Cell
};

struct SamplePoints {  // points of the data set such that every point of it lies within covering_radius_um of one of
                       // them
  std::vector<GridPoint> points;
  std::vector<SegmentId> segments;  // a segment that holds the point, the lowest if several
  std::vector<float> t;             // where on it: 0 child .. 1 parent
  double covering_radius_um = 0;
};

// The least that a byte budget for tiles can be: room for the two largest, and the long-segment tile, which stays.
class TileFloor {
 public:
  void add(std::uint64_t bytes, bool is_long);  // TileEntry::decoded_bytes of each tile
  std::uint64_t bytes() const { return largest_ + second_ + long_; }

 private:
  std::uint64_t largest_ = 0, second_ = 0, long_ = 0;
};

class TileStore {
 public:
  virtual ~TileStore() = default;

  virtual Grid grid() const = 0;
  // For the haptic thread, which asks for nodes of tiles in memory only: see LeafIndex::home().
  virtual const LeafIndex& leaves() const = 0;
  // The tile whose cell contains the point, or kNoTile where space is empty. Like entry(), reads a page of the
  // directory if this is the first need of it: throws CorruptSet, IoError. O(log tiles).
  virtual TileId home(const GridPoint& p) const = 0;
  // Tiles, the long-segment tile included: ids 0 .. tile_count()-1.
  virtual TileId tile_count() const = 0;
  virtual TileId long_tile() const = 0;  // kNoTile where there is none
  virtual const TileEntry& entry(TileId tile) const = 0;
  // The directory's pages, each of page_tiles() tiles but the last, and a box around the content of a page's tiles,
  // known without reading it. O(1), or O(page_tiles()) where there is nothing to read.
  virtual TileId page_tiles() const { return 4096; }
  virtual GridBox pageContent(std::uint32_t page) const;
  // Bytes in memory of the two largest tiles and the long-segment tile together. O(tiles), all pages are read and
  // checked.
  virtual std::uint64_t floorBytes() const;
  virtual std::uint32_t capacity() const = 0;

  // Reads, checks and decodes. The homes of the tile's nodes are in leaves() from then on. Throws CorruptTile, IoError.
  // O(segments of the tile) and one disk read.
  virtual std::shared_ptr<const Tile> load(TileId tile) const = 0;
  virtual TileAppearance loadAppearance(TileId tile) const = 0;  // likewise

  virtual std::uint32_t cell_count() const = 0;
  virtual const CellRecord& cell(std::uint32_t id) const = 0;
  virtual std::optional<std::uint32_t> findCell(const std::string& name) const = 0;  // O(log cells)
  virtual CellDetail loadCellDetail(std::uint32_t id) const = 0;                     // Throws CorruptSet, IoError

  virtual const SamplePoints& samples() const = 0;  // loaded at the first call
};

}  // namespace filiform
