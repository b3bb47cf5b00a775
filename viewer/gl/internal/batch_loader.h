// A loading thread that reads tiles and makes batches of them, so that no frame waits for the disk. Thread rule: one
// caller, the drawing thread.
#pragma once

#include "index/levels/levels.h"
#include "index/set/tile_store.h"
#include "viewer/scene/neurite_batches.h"

#include <exception>
#include <memory>
#include <vector>

namespace filiform::internal {

struct TileJob {
  std::uint32_t key = 0;  // chosen by the caller
  bool level = false;     // `tile` is a level tile
  std::uint32_t tile = 0;
  std::uint32_t whole_cell = UINT32_MAX;  // if set: load this cell in full resolution instead of the tile
  bool only_below = false;                // read what lies below the level tile (Levels::below()), not the tile
};

struct LoadedTile {
  TileJob job;
  NeuriteBatch batch;        // sorted for drawing; empty if `only_below`
  std::exception_ptr error;  // why the tile cannot be read; else nullptr
};

class BatchLoader {
 public:
  // Store and levels (may be nullptr) must outlive it.
  BatchLoader(const TileStore& store, const Levels* levels);
  ~BatchLoader();  // waits for the tile that is being read
  void stop();     // begins no further tile; does not wait

  // Replaces the list of jobs; they are done in this order. A job that is under way or waits to be taken is not done
  // again. O(jobs * tiles that wait to be taken).
  void want(std::vector<TileJob> jobs);
  // Takes the next loaded tile. False: none is loaded.
  bool take(LoadedTile& tile);
  // True: no job is left or under way, and no tile waits to be taken.
  bool isIdle() const;
  // Waits until a tile can be taken or no job is left, at most `most_s`. True: a tile can be taken.
  bool wait(double most_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::internal
