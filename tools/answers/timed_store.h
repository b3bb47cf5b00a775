// TimedStore: a tile store whose reads end when the time for an answer is over.
//
//   TimedStore::Limit limit(5);     // for this thread, until the end of the block
//   nearest.find(p_W, {.k = 1});    // Nearest over a TimedStore: throws AnswerTimeout instead of reading more tiles
//
// A search that reads many tiles then stops. Work on tiles in memory is not interrupted. Thread rule: internally
// synchronised; a Limit belongs to its thread.
#pragma once

#include "index/set/tile_store.h"

namespace filiform::tools {

class TimedStore final : public TileStore {
 public:
  // The store must outlive this object.
  explicit TimedStore(const TileStore& store) : store_(store) {}

  // Limits the reads of this thread while it lives. Limits do not nest.
  class Limit {
   public:
    explicit Limit(double seconds);
    ~Limit();
    Limit(const Limit&) = delete;
    Limit& operator=(const Limit&) = delete;
  };
  // Throws AnswerTimeout if this thread has a limit and the time is over.
  static void check();

  Grid grid() const override { return store_.grid(); }
  const LeafIndex& leaves() const override { return store_.leaves(); }
  TileId home(const GridPoint& p) const override { return store_.home(p); }
  TileId tile_count() const override { return store_.tile_count(); }
  TileId long_tile() const override { return store_.long_tile(); }
  const TileEntry& entry(TileId tile) const override { return store_.entry(tile); }
  TileId page_tiles() const override { return store_.page_tiles(); }
  std::uint32_t group_pages() const override { return store_.group_pages(); }
  GridBox pageContent(std::uint32_t page) const override { return store_.pageContent(page); }
  GridBox groupContent(std::uint32_t group) const override { return store_.groupContent(group); }
  std::uint64_t floorBytes() const override { return store_.floorBytes(); }
  std::uint32_t capacity() const override { return store_.capacity(); }
  bool isRemote() const override { return store_.isRemote(); }
  std::shared_ptr<const Tile> load(TileId tile) const override;
  TileAppearance loadAppearance(TileId tile) const override;
  std::uint32_t cell_count() const override { return store_.cell_count(); }
  const CellRecord& cell(std::uint32_t id) const override { return store_.cell(id); }
  std::optional<std::uint32_t> findCell(const std::string& name) const override { return store_.findCell(name); }
  CellDetail loadCellDetail(std::uint32_t id) const override;
  const Landmarks& landmarks() const override { return store_.landmarks(); }

 private:
  const TileStore& store_;
};

}  // namespace filiform::tools
