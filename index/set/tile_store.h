// TileStore: a set of tiles, on disk (tile_set.h) or in memory for a small scene (memory_tiles.h). Search, residency,
// export and navigation use only this interface. Thread rule: internally synchronised; the haptic thread must not load.
#pragma once

#include "index/cell/cell.h"
#include "index/cell/id_runs.h"
#include "index/tile/leaf_index.h"
#include "index/tile/tile.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

struct TileEntry {  // what the directory states about a tile
  BlockKey key;
  GridBox content;             // stored segments, clipped to the closed block; not clipped in the long-segment tile
  std::uint32_t owned = 0;     // owned segments, isolated ones included
  std::uint32_t stored = 0;    // owned + ghosts
  std::uint32_t isolated = 0;  // of the owned: zero-length segments of isolated samples
  std::uint64_t decoded_bytes = 0;  // Tile::bytes() after loading
  TypeMask types = kAnyType;        // at least those of all stored segments; kAnyType: not known
};

// What the table of cells states about a cell.
struct CellRecord {
  std::string name, source;
  std::uint64_t samples = 0, segments = 0, isolated = 0,
                roots = 0;  // roots: samples without a parent, isolated ones included
  GridBox bounds;
  bool removed = false;  // all else is then empty
};

// True if the cell has loops; its segments are then named by their position among its links (index/cell/cell.h). A
// cell with loops has more links than a forest.
inline bool hasLoops(const CellRecord& cell) { return cell.segments + cell.roots > cell.samples; }

// The rest of what a set stores about a cell.
struct CellDetail {
  struct Root {
    std::uint32_t rank;
    float radius_um;
    std::uint16_t type;
  };
  std::vector<TileId> tiles;                // tiles that own a segment of the cell, ascending
  IdRuns sample_ids;                        // by rank
  std::vector<Root> roots;                  // ascending by rank; holds the attributes that no segment carries
  std::vector<std::uint32_t> block_starts;  // as in Cell
  std::string header;                       // as in Cell
  // The odd radii (index/cell/radius.h), ascending by rank: the bits of the 64-bit radius minus those of the 32-bit
  // radius that is stored elsewhere, widened to 64 bits.
  struct OddBits {
    std::uint32_t rank;
    std::int64_t difference;
  };
  std::vector<OddBits> odd_radii;
};

struct Landmarks {  // landmarks: every point of the data lies within covering_radius_um of one
  std::vector<GridPoint> points;
  std::vector<SegmentId> segments;  // the segment that holds the point; the lowest if several
  std::vector<float> t;             // position on the segment: 0 child .. 1 parent
  double covering_radius_um = 0;
};

// The smallest byte budget for tiles: room for the two largest tiles and for the long-segment tile, which always stays.
class TileFloor {
 public:
  void add(std::uint64_t bytes, bool is_long);  // once a tile; `bytes`: TileEntry::decoded_bytes
  std::uint64_t bytes() const { return largest_ + second_ + long_; }

 private:
  std::uint64_t largest_ = 0, second_ = 0, long_ = 0;
};

// The box that an overview frames (index/set/usual_box.h).
struct UsualBox {
  GridBox box;                // empty without segments
  std::uint64_t outside = 0;  // segments of tiles outside the box; 0: the box is that of all segments
};

class TileStore {
 public:
  virtual ~TileStore() = default;

  virtual Grid grid() const = 0;
  // For the haptic thread, which asks only for nodes of tiles in memory; see LeafIndex::home().
  virtual const LeafIndex& leaves() const = 0;
  // The tile whose block contains the point, or kNoTile if space is empty there. home() and entry() read a page of the
  // directory at its first use. Throws CorruptSet, IoError. O(log tiles).
  virtual TileId home(const GridPoint& p) const = 0;
  // Number of tiles, including the long-segment tile. Ids are 0 .. tile_count()-1.
  virtual TileId tile_count() const = 0;
  virtual TileId long_tile() const = 0;  // kNoTile: there is none
  virtual const TileEntry& entry(TileId tile) const = 0;
  // The directory has pages of page_tiles() tiles, and groups of group_pages() pages; the last ones may be smaller.
  virtual TileId page_tiles() const { return 4096; }
  virtual std::uint32_t group_pages() const { return 256; }
  // A box around the content of a page's tiles. Reads the record of the page's group at its first use. Throws
  // CorruptSet, IoError. O(1); O(page_tiles()) for stores in memory.
  virtual GridBox pageContent(std::uint32_t page) const;
  // A box around the content of a group's tiles, known without reading. O(1); O(tiles of the group) for stores in
  // memory.
  virtual GridBox groupContent(std::uint32_t group) const;
  // Some boxes that together contain the content of the page's or the group's leaves, often closer than the box around
  // all. Cost and errors as above.
  virtual std::vector<GridBox> pageBoxes(std::uint32_t page) const { return {pageContent(page)}; }
  virtual std::vector<GridBox> groupBoxes(std::uint32_t group) const { return {groupContent(group)}; }
  // Bytes in memory of the two largest tiles and the long-segment tile together. O(1); O(tiles) for stores in memory.
  virtual std::uint64_t floorBytes() const;
  // Segments of all cells, without isolated samples; bytes of all tiles in memory. O(1); O(cells), O(tiles) for stores
  // in memory.
  virtual std::uint64_t segmentCount() const;
  virtual std::uint64_t decodedBytes() const;
  // O(1) if the set states it. Otherwise reads the whole directory at the first call. Throws CorruptSet, IoError.
  // O(tiles log tiles), also for stores in memory.
  virtual UsualBox usualBox() const;
  virtual std::uint32_t capacity() const = 0;
  // True if loads travel over a network; see TileSource.
  virtual bool isRemote() const { return false; }

  // Reads, checks and decodes a tile. From then on, leaves() contains the homes of its nodes. Throws CorruptTile,
  // IoError. One disk read, O(segments of the tile).
  virtual std::shared_ptr<const Tile> load(TileId tile) const = 0;
  // As load(), for a search: leaves() need not contain the homes of the tile's nodes, so no page is read for them.
  virtual std::shared_ptr<const Tile> loadToSearch(TileId tile) const { return load(tile); }
  virtual TileAppearance loadAppearance(TileId tile) const = 0;  // like load()

  // Ids are 0 .. cell_count()-1. Some cells may be removed (CellRecord::removed).
  virtual std::uint32_t cell_count() const = 0;
  // These read a page of the table of cells at its first use. They throw CorruptSet, IoError.
  virtual const CellRecord& cell(std::uint32_t id) const = 0;
  virtual std::optional<std::uint32_t> findCell(const std::string& name) const = 0;  // O(log cells)
  virtual CellDetail loadCellDetail(std::uint32_t id) const = 0;
  // CellDetail::tiles alone. A set on disk reads the detail, but decodes only these. O(bytes of the detail) for sums.
  virtual std::vector<TileId> cellTiles(std::uint32_t id) const { return loadCellDetail(id).tiles; }

  virtual const Landmarks& landmarks() const = 0;  // the landmarks; loaded at the first call
};

}  // namespace filiform
