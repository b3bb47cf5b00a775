// Replays a recorded session: the same states and the same PROXY frames, bit for bit. Functions without state.
#pragma once

#include "index/set/tile_store.h"

#include <cstdint>
#include <string>

namespace filiform::tools {

struct SessionReplay {
  std::string set, revision;  // that the session travelled
  std::uint64_t ticks = 0;
  std::uint64_t hands = 0, proxies = 0;  // in the recording
  // Ticks whose hand, interpolated from the HANDs, differs in a bit from the recorded one. PROXY frames that differ in
  // a bit from the recorded ones.
  std::uint64_t differing_hands = 0, differing_proxies = 0;
  bool isEqual() const { return differing_hands == 0 && differing_proxies == 0; }
};

// The revision that a recording needs. Throws IoError, InputError.
std::string recordedRevision(const std::string& path);

// `path`: FILE.rec, with FILE.rec.json and FILE.rec.frames beside it. The store has the recorded revision. Throws
// DeviceError, IoError and InputError for the recording; CorruptTile and IoError from the store. Takes about 20 us a
// tick, and memory for the whole recording.
SessionReplay replaySession(const TileStore& store, const std::string& path);

}  // namespace filiform::tools
