// TileSet: a tile set on disk, as ingest publishes it. FORMAT.md specifies every byte.
//
//   const auto set = TileSet::open("column.fil");
//   const std::shared_ptr<const Tile> tile = set->load(0);
#pragma once

#include "index/file/tile_source.h"
#include "index/remote/remote_options.h"
#include "index/set/set_counts.h"
#include "index/set/tile_store.h"

#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace filiform {

namespace internal {
struct Patch;
struct TileLocation;
}  // namespace internal

// Thread rule: internally synchronised.
class TileSet final : public TileStore {
 public:
  // Opens a set by its name, a folder or an address (http_source.h); `remote` is for addresses. Opens the revision that
  // CURRENT names, or `revision` if it is given, and keeps reading it if another is published later. openFolder()
  // states how many files stay open. Reads CURRENT and the manifest. All other data are read and checked at first use:
  // before the first tile, two pages of the directory. Throws IoError if there is no tile set, InputError if an older
  // filiform made it, CorruptSet if the bytes differ from those written. O(pages of the directory).
  static std::unique_ptr<TileSet> open(const std::string& name, const RemoteOptions& remote = {},
                                       const std::string& revision = {});
  static std::unique_ptr<TileSet> open(std::unique_ptr<TileSource> source, const std::string& revision = {});
  ~TileSet() override;

  Grid grid() const override;
  const LeafIndex& leaves() const override;
  TileId home(const GridPoint& p) const override;
  TileId tile_count() const override;
  TileId long_tile() const override;
  const TileEntry& entry(TileId tile) const override;
  TileId page_tiles() const override;
  std::uint32_t group_pages() const override;
  GridBox pageContent(std::uint32_t page) const override;
  GridBox groupContent(std::uint32_t group) const override;
  std::vector<GridBox> pageBoxes(std::uint32_t page) const override;
  std::vector<GridBox> groupBoxes(std::uint32_t group) const override;
  std::uint64_t floorBytes() const override;
  std::uint64_t segmentCount() const override;
  std::uint64_t decodedBytes() const override;
  UsualBox usualBox() const override;
  bool isRemote() const override;
  std::uint32_t capacity() const override;
  std::shared_ptr<const Tile> load(TileId tile) const override;
  std::shared_ptr<const Tile> loadToSearch(TileId tile) const override;
  TileAppearance loadAppearance(TileId tile) const override;
  std::uint32_t cell_count() const override;
  // The table of cells has a root and pages of 256 cells. Pages stay in memory once they are read.
  const CellRecord& cell(std::uint32_t id) const override;
  std::optional<std::uint32_t> findCell(const std::string& name) const override;
  CellDetail loadCellDetail(std::uint32_t id) const override;
  std::vector<TileId> cellTiles(std::uint32_t id) const override;
  const Landmarks& landmarks() const override;

  std::uint32_t format() const;         // version of the format, as the manifest states it
  const std::string& revision() const;  // name of the revision's folder
  const std::string& manifest() const;  // text of the manifest, JSON
  std::string readProvenance() const;   // text of provenance.json; throws CorruptSet, IoError
  std::uint64_t refused() const;        // number of inputs that ingest refused
  std::uint64_t skipped() const;        // number of entries that ingest left out of archives, other versions excepted
  const SetCounts& counts() const;      // as the manifest states
  const GridBox& bounds() const;        // of all samples
  const std::vector<SetFile>& files() const;
  // Sections hold data beside the tiles, for some commands only: readers ignore sections that they do not know.
  std::vector<std::string> sections() const;  // their names, ascending
  // The bytes of a section; nullopt if the set has none of this name. Throws CorruptSet, IoError. O(bytes).
  std::optional<std::vector<std::uint8_t>> section(const std::string& name) const;
  std::uint64_t bytes() const;  // of all files of the revision, including the manifest
  // Reads part of a file of the revision, unchecked. Throws CorruptSet, IoError.
  void read(const std::string& file, std::uint64_t offset, std::span<std::uint8_t> bytes) const;
  // The same, for sizes that a file states: memory grows with the bytes that arrive.
  std::vector<std::uint8_t> read(const std::string& file, std::uint64_t offset, std::uint64_t bytes) const;
  // As TileSource::discard(), for a file of the revision.
  bool discard(const std::string& file, std::uint64_t offset, std::uint64_t bytes) const;
  std::string describe(const std::string& file) const;   // the file's name for messages
  std::optional<RemoteCounters> remoteCounters() const;  // of a set at an address: what was asked of the server so far
  // For each range of keys (first and last): the first full-resolution tile whose block begins there, and the tile
  // after the last one. Ranges ascend. Reads the pages of the directory that may hold such tiles, from a set at an
  // address many at once. Throws CorruptSet, IoError. O(ranges log tiles + pages).
  std::vector<std::pair<TileId, TileId>> leavesWithin(std::span<const std::pair<MortonKey, MortonKey>> ranges) const;
  // Reads the pages of the directory, from a set at an address many at once. For work that then needs all entries.
  // Throws CorruptSet, IoError. O(tiles).
  void readDirectory() const;
  // Reads all remaining pages of the directory and compares their sums with the manifest. Throws CorruptSet, IoError.
  void checkDirectory() const;
  // The same with the table of cells, one page at a time.
  void checkCells() const;
  // Reads a whole file of the revision, passes its bytes to `use` in pieces, and compares its size and digest with the
  // manifest. Throws CorruptSet, IoError.
  using UseBytes = std::function<void(std::span<const std::uint8_t> bytes)>;
  void checkFile(const SetFile& file, const UseBytes& use = {}) const;
  // File and offset of a tile, for messages.
  std::pair<std::string, std::uint64_t> place(TileId tile) const;
  // True if cells were added or removed since the set was made (index/ingest/growth.h). Its leaves then need not follow
  // from its segments.
  bool grown() const;

  // For index/ingest/: how the set stores a tile or a cell. They throw CorruptSet, IoError.
  const internal::TileLocation& location(TileId tile) const;
  const internal::Patch* patch(TileId tile) const;               // nullptr: none
  std::pair<Tile, TileAppearance> loadPatch(TileId tile) const;  // requires patch(tile)
  std::uint64_t cellDigest(std::uint32_t id) const;
  std::vector<std::uint8_t> encodedDetail(std::uint32_t id) const;

 private:
  struct Impl;
  explicit TileSet(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
