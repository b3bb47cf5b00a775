// Hostile bytes for everything that reads what others wrote. One function a reader, as libFuzzer wants it: any bytes,
// no effect, and an abort where a promise of the reader's header is broken. What a header allows to be thrown is caught
// here; anything else ends the program. tests/fuzz/README.md says how they are run.
// Thread rule: one thread.
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
void fuzzPlacements(Input input);
void fuzzText(Input input);
void fuzzTile(Input input);
void fuzzDirectory(Input input);
void fuzzManifest(Input input);
void fuzzFalcon(Input input);
void fuzzSpaceMouse(Input input);
void fuzzRecording(Input input);

// A promise that was not kept.
inline void require(bool kept, const char* promise) {
  if (kept) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

}  // namespace filiform::fuzz
