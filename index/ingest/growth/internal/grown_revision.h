// GrownRevision: writes a revision that refers to the tiles of an older one, and adds, replaces or drops some.
#pragma once

#include "index/ingest/tiling/internal/tile_writer.h"
#include "index/set/tile_set.h"
#include "index/tile/tile.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace filiform::internal {

// Thread rule: thread-compatible. Every member throws IoError, CorruptSet.
class GrownRevision {
 public:
  // `base` must outlive this object. `folder` is empty; the files of the new revision go there. `bounds`: the box of
  // all samples of the new revision.
  GrownRevision(const TileSet& base, std::string folder, const GridBox& bounds, std::uint64_t pack_bytes);

  // The number by which a tile is named until finish(): any order.
  using Item = std::uint32_t;
  Item keep(TileId tile);  // of the base, as it is
  // A tile of these segments, ascending by id. `was`: the base's tile that it replaces. `types`: at least theirs.
  Item write(std::optional<TileId> was, const BlockKey& key, bool is_long, std::vector<StoredSegment> segments,
             const TileAppearance& look, TypeMask types);
  // Adds segments of new cells to a tile of the base, ascending by id. Few segments become a patch; otherwise the tile
  // is written anew.
  Item add(TileId tile, std::vector<StoredSegment> segments, const TileAppearance& look, TypeMask types);

  struct Counts {
    std::uint64_t kept = 0, patched = 0, written = 0;
  };
  const Counts& counts() const { return counts_; }
  // Gives the tiles their ids. Call it once, after the last tile.
  void number();
  TileId tileOf(Item item) const { return id_of_item_[item]; }  // after number()
  std::optional<TileId> tileNow(TileId of_base) const;          // after number(); nullopt: dropped

  // After number(). See TileWriter.
  TileWriter& writer() { return writer_; }
  std::string finish(const Provenance& provenance);

 private:
  struct Placed {
    TileEntry entry;
    TileLocation at;
    bool is_long;
    TileId was;  // kNoTile: new
    std::optional<Patch> patch;
  };
  Item place(const Placed& placed);

  const TileSet& base_;
  GridBox bounds_;
  TileWriter writer_;
  std::vector<Placed> items_;
  std::vector<TileId> id_of_item_, now_;
  Counts counts_;
};

}  // namespace filiform::internal
