// The somata of a set of tiles, found where they are needed: from a sample, over the home tiles of the soma's samples.
// Nothing is stored for them in a set. As a rule a soma lies in one tile, or two.
//
// Thread-compatible: reads the store, so not for the haptic thread.
#pragma once

#include "index/soma.h"
#include "index/tile_store.h"

#include <array>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

namespace filiform {

class SomaFinder {
 public:
  explicit SomaFinder(const TileStore& store) : store_(store) {}  // which must outlive it

  // The soma that the sample belongs to, as its root or one of its samples; null where it belongs to none that means
  // something else than its samples. `at` is the sample's grid point. Answers are kept, one entry for each sample of
  // type 1 that was asked for or passed. Throws CorruptTile, CorruptSet, IoError from the store. O(samples of the soma)
  // and the reads of their tiles at first; then O(1) for soma samples, one read at most for others.
  std::shared_ptr<const Soma> of(NodeId sample, const GridPoint& at);
  // The same, null where the store throws: the sample is then taken as it is.
  std::shared_ptr<const Soma> ofIfReadable(NodeId sample, const GridPoint& at) noexcept;

  // From a place alone: the soma with a sample of that cell at the grid point. Null where there is none, or the store
  // throws. Costs as of(), and O(nodes of the point's home tile).
  std::shared_ptr<const Soma> atIfReadable(std::uint32_t cell, const GridPoint& at) noexcept;

  // Saves reading what the caller has read already.
  void offer(std::shared_ptr<const Tile> tile, TileAppearance appearance);
  void offer(std::uint32_t cell, const CellDetail& detail);

 private:
  struct Held {
    std::shared_ptr<const Tile> tile;
    TileAppearance appearance;
  };
  struct Place {
    const Held* held = nullptr;
    std::uint32_t node = 0;  // in held->tile
  };
  static constexpr std::size_t kMostHeld = 8, kMostCells = 1024;

  const Held& hold(TileId tile);
  Place homeOf(NodeId sample, const GridPoint& at);  // held: null where there is none
  const std::vector<CellDetail::Root>& rootsOf(std::uint32_t cell);
  std::shared_ptr<const Soma> read(const CellDetail::Root& root, NodeId sample, const GridPoint& at);

  const TileStore& store_;
  std::array<Held, kMostHeld> held_;
  std::size_t next_ = 0;
  std::unordered_map<std::uint32_t, std::vector<CellDetail::Root>> roots_;  // of type 1
  std::unordered_map<std::uint64_t, std::shared_ptr<const Soma>> known_;    // by NodeId::key(), of samples of type 1
};

}  // namespace filiform
