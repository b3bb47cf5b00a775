// What the work of panels on threads of its own shares. Thread rule: functions without state.
#pragma once

#include "index/set/tile_store.h"

#include <atomic>
#include <cstdint>
#include <sys/resource.h>
#include <vector>

namespace filiform::internal {

struct Stopped {};  // thrown by work that is to end

// Of this thread. Frames go first where cores are few.
inline void lowerPriority() { ::setpriority(PRIO_PROCESS, 0, 10); }

// All cells that are not removed, ascending. Their records then need no disk. Throws Stopped, CorruptSet, IoError.
inline std::vector<std::uint32_t> presentCells(const TileStore& store, const std::atomic<bool>& stop) {
  std::vector<std::uint32_t> cells;
  for (std::uint32_t cell = 0; cell < store.cell_count(); ++cell) {
    if (stop) throw Stopped();
    if (!store.cell(cell).removed) cells.push_back(cell);
  }
  return cells;
}

}  // namespace filiform::internal
