// Hostile bytes for every reader of foreign data. One function a reader, in the form that libFuzzer needs: any bytes,
// no effect, and an abort if a promise of the reader's header is broken. Exceptions that a header allows are caught
// here; any other exception ends the program. tests/fuzz/README.md says how to run them. Thread rule: one thread.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

namespace filiform::fuzz {

using Input = std::span<const std::uint8_t>;

void fuzzSwc(Input input);
void fuzzGraph(Input input);
void fuzzZip(Input input);
void fuzzPacked(Input input);
void fuzzJson(Input input);
void fuzzAsc(Input input);
void fuzzShard(Input input);
void fuzzPlacements(Input input);
void fuzzText(Input input);
void fuzzTile(Input input);
void fuzzDirectory(Input input);
void fuzzManifest(Input input);
void fuzzFalcon(Input input);
void fuzzSpaceMouse(Input input);
void fuzzBridge(Input input);
void fuzzHaply(Input input);
void fuzzRecording(Input input);
void fuzzRequest(Input input);
void fuzzSession(Input input);
void fuzzHdf5(Input input);

// Aborts if a promise is broken.
inline void require(bool kept, const char* promise) {
  if (kept) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

}  // namespace filiform::fuzz
