// A thread that reads tiles and makes batches of them, so that no frame waits for the disk. Thread rule: the members
// are for one thread, that of the drawing.
#pragma once

#include "index/set/levels.h"
#include "index/set/tile_store.h"
#include "viewer/scene/neurite_batches.h"

#include <exception>
#include <memory>
#include <vector>

namespace filiform::internal {

struct TileJob {
  std::uint32_t key = 0;  // of the caller's
  std::uint32_t generation = 0;
  bool level = false;
  std::uint32_t tile = 0;
  ColourBy colour = ColourBy::cell;
  std::uint32_t whole_cell = UINT32_MAX;  // if it is one: not the tile, but all of that cell in full resolution
};

struct LoadedTile {
  TileJob job;
  NeuriteBatch batch;        // thickest first
  std::exception_ptr error;  // the tile cannot be read
};

class BatchLoader {
 public:
  // Store and levels (which may be nullptr) must outlive it. The depths are those of ColourBy::depth.
  BatchLoader(const TileStore& store, const Levels* levels, double shallow_um, double deep_um);
  ~BatchLoader();  // waits for the tile that is being read
  void stop();     // begins no further tile; does not wait

  // From now on these, in this order; what was wanted before and is not begun is forgotten. What is being read, or
  // waits to be taken, is not read again. O(jobs * tiles that wait to be taken).
  void want(std::vector<TileJob> jobs);
  // The next that is done, if there is one.
  bool take(LoadedTile& tile);
  // Nothing more can come: no job is left, none is under way, none waits to be taken.
  bool isIdle() const;
  // Until one can be taken or nothing is left to do, at most so long. True when one can be taken.
  bool wait(double most_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::internal
