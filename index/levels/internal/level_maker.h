// Makes the level tiles of a part of the octree, bottom-up.
#pragma once

#include "index/file/internal/spool.h"
#include "index/internal/memory_budget.h"
#include "index/levels/internal/level_blocks.h"
#include "index/levels/internal/level_input.h"
#include "index/levels/internal/level_somata.h"
#include "index/levels/internal/level_tile.h"
#include "index/levels/internal/neurites.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace filiform::internal {

// A leaf whose neurites are still to be read, or the neurites of a block, in memory or in the spool.
struct LevelPiece {
  std::size_t first_leaf = 0;
  std::uint64_t finer = 0;  // segments of the finest tiles, of a level or in full resolution, that show the same
  BlockKey block{};
  std::uint32_t tiles_of_block = 0;  // level tiles made with this block
  std::optional<TileId> leaf;
  Neurites neurites;
  MemoryBudget::Hold hold;
  std::optional<ByteChain> spooled;
};

// The pieces of a block, in the order of their keys.
struct LevelContent {
  std::vector<LevelPiece> pieces;
  std::uint64_t points = 0;
  std::uint64_t finer = 0;  // of the pieces
};

// The neurites of the block at work. A thread uses the same memory for one block after another: the system takes long
// to give it anew. Thread rule: of one thread.
class BlockWork {
 public:
  explicit BlockWork(MemoryBudget& budget) : budget_(budget), hold_(budget, 0) {}

  Neurites neurites;

  std::uint64_t bytes() const { return hold_.bytes(); }
  // Clears it for a block of `points`, and holds the memory for its work. Throws BeyondBudget.
  void begin(std::uint64_t points, std::uint64_t work_bytes);
  // Holds the memory for a tile of what is left of the neurites. Throws BeyondBudget.
  void beginTile();
  // Returns all memory.
  void end();

 private:
  MemoryBudget& budget_;
  MemoryBudget::Hold hold_;
};

// Walks the octree; what it makes comes out in key order. Thread rule: of one thread; several may share all arguments
// but `work`.
class LevelMaker {
 public:
  LevelMaker(const LevelInput& input, const LevelBlocks& blocks, const LevelSomata& somata, MemoryBudget& budget,
             Spool& spool, BlockWork& work)
      : input_(input), blocks_(blocks), somata_(somata), budget_(budget), spool_(spool), work_(work) {}
  virtual ~LevelMaker() = default;
  LevelMaker(const LevelMaker&) = delete;
  LevelMaker& operator=(const LevelMaker&) = delete;

  // Makes the tiles of these leaves, and returns what the block above needs. Throws BeyondBudget, IoError, and what the
  // input throws. O(segments).
  LevelContent make(const LeafRange& range);

 protected:
  // Makes a part of a block, or returns it if it was made before.
  virtual LevelContent part(const LeafRange& range) { return make(range); }
  // Takes the next tile.
  virtual void emit(LevelTile tile) = 0;

  const LevelInput& input_;
  const LevelBlocks& blocks_;
  const LevelSomata& somata_;
  MemoryBudget& budget_;
  Spool& spool_;
  BlockWork& work_;

 private:
  LevelContent leaf(const LeafRange& range) const;
  LevelContent coarsened(const LeafRange& range, const BlockKey& block, LevelContent content, bool has_level);
  // A part of a block's neurites that gets a tile of its own.
  struct Cut {
    BlockKey key;
    std::size_t first_leaf;
    std::uint32_t coarser;   // tiles of the same key that are finer
    std::size_t begin, end;  // pieces
    std::uint64_t finer;     // of the pieces
  };
  void cut(std::span<const LevelPiece> pieces, std::size_t begin, const LeafRange& range, std::uint64_t most_finer,
           std::vector<Cut>& cuts) const;
  void gather(std::span<LevelPiece> pieces, Neurites& all) const;
  // Keeps the neurites of a block for the block above.
  void keep(const Neurites& neurites, LevelPiece piece, LevelContent& content);
  class Joined;
  std::vector<LevelPiece> tiles(std::span<const Cut> cuts, const Joined& joined, double fewer);
  // Makes coarser levels of the outermost block, until one tile fits every limit. `pieces`: what its tiles show.
  void makeCoarser(const LeafRange& range, const BlockKey& block, double parts, std::vector<LevelPiece> pieces);
};

}  // namespace filiform::internal
