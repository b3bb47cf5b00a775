// Tiles that many sessions share: one budget, one table. Thread rule: a value; see Session for the ticking thread.
#pragma once

#include "index/streaming/residency.h"

namespace filiform {

// One thread ticks all sessions that share the reader. Before it ticks them, it calls reader->apply().
struct SharedTiles {
  Residency* residency = nullptr;
  TileReader* reader = nullptr;  // of this residency
};

}  // namespace filiform
