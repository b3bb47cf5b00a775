// OpenedScene: what a window shows. Thread rule: plain data.
#pragma once

#include "index/file/remote_counters.h"
#include "index/levels/levels.h"
#include "index/set/tile_set.h"
#include "index/set/tile_store.h"
#include "viewer/scene/cell_colours.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace filiform {

struct OpenedScene {
  std::unique_ptr<TileStore> store;
  std::function<std::unique_ptr<Levels>()> open_levels;  // of the store, on another thread; empty: it has none
  std::unique_ptr<Levels> levels;                        // what it returned
  std::function<RemoteCounters()> network;               // of a scene at an address; empty: it has none
  bool in_memory = false;
  std::string name;      // for the user
  std::string revision;  // of a tile set; empty: of none
  // Cells that alone are shown at first, and chosen ones; ascending; empty: all, and none.
  std::vector<std::uint32_t> only, highlighted;
  std::shared_ptr<const CellColours> colours;  // at first; nullptr: as the settings say

  // The scene becomes this set: sets `store`, `open_levels`, `network` and `revision`. From far away, opening the
  // levels of a set that has none reads its whole directory instead: a picture then needs all of it, and must not wait.
  void hold(std::unique_ptr<TileSet> set);
};

}  // namespace filiform
