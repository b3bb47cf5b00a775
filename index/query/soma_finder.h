// Finds the somata of a tile set on demand: from one sample, through the home tiles of the soma's samples. A set stores
// no somata. A soma usually lies in one or two tiles.
//
// Thread rule: thread-compatible. It reads the store, so the haptic thread must not call it.
#pragma once

#include "index/cell/soma.h"
#include "index/set/tile_store.h"

#include <array>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

namespace filiform {

class SomaFinder {
 public:
  explicit SomaFinder(const TileStore& store) : store_(store) {}  // `store` must outlive this object

  // The soma of which the sample is the root or a part. nullptr if the sample is in no soma, if the soma's samples mean
  // only themselves, or if the cell has loops. `at` is the sample's grid point. Requires sample.cell < cell_count().
  // Results are kept, one for each sample of type 1 met. Throws CorruptTile, CorruptSet, IoError from the store. Cost
  // of the first call: O(samples of the soma) and reading their tiles. Later calls: O(1) for soma samples, at most one
  // tile read for others.
  std::shared_ptr<const Soma> of(NodeId sample, const GridPoint& at);
  // Like of(), but returns nullptr if the store throws. The caller then draws the samples as they are.
  std::shared_ptr<const Soma> ofIfReadable(NodeId sample, const GridPoint& at) noexcept;

  // Like ofIfReadable(), from a place alone: the soma with a sample of that cell at the grid point. nullptr if there is
  // none. Costs as of(), and O(nodes of the point's home tile).
  std::shared_ptr<const Soma> atIfReadable(std::uint32_t cell, const GridPoint& at) noexcept;

  // Hands over data that the caller has read, to avoid a second read.
  void offer(std::shared_ptr<const Tile> tile, TileAppearance appearance);
  void offer(std::uint32_t cell, const CellDetail& detail);

 private:
  struct Held {
    std::shared_ptr<const Tile> tile;
    TileAppearance appearance;
  };
  struct Place {
    std::shared_ptr<const Held> held;
    std::uint32_t node = 0;  // in held->tile
  };
  struct Look {
    float radius_um = kUnknownRadius;
    std::uint16_t type = 0;
  };
  static constexpr std::size_t kMostHeld = 8, kMostCells = 1024;

  std::shared_ptr<const Held> hold(TileId tile);
  Look lookOf(const Held& held, std::uint32_t segment);  // of the segment's child, from the tile that owns the segment
  Place homeOf(NodeId sample, const GridPoint& at);      // held: nullptr if the store has no such node
  const std::vector<CellDetail::Root>& rootsOf(std::uint32_t cell);
  std::shared_ptr<const Soma> read(const CellDetail::Root& root, NodeId sample, const GridPoint& at);

  const TileStore& store_;
  std::array<std::shared_ptr<const Held>, kMostHeld> held_;
  std::size_t next_ = 0;
  std::unordered_map<std::uint32_t, std::vector<CellDetail::Root>> roots_;  // by cell: roots of type 1
  std::unordered_map<std::uint64_t, std::shared_ptr<const Soma>> known_;    // by NodeId::key(): samples of type 1
};

}  // namespace filiform
