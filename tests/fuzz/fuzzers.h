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
void fuzzProperties(Input input);
void fuzzZip(Input input);
void fuzzPacked(Input input);
void fuzzJson(Input input);
void fuzzNml(Input input);
void fuzzCsv(Input input);
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

struct Target {
  const char* name;  // also of the folder of its seeds
  void (*run)(Input);
  unsigned mutations;  // in each run of the tests: about a second under the address sanitizer
};
// The slowest targets first, which is best when they run side by side.
inline constexpr Target kTargets[] = {
    {"falcon", fuzzFalcon, 10000},
    {"swc", fuzzSwc, 10000},
    {"graph", fuzzGraph, 10000},
    {"manifest", fuzzManifest, 10000},
    {"recording", fuzzRecording, 20000},
    {"zip", fuzzZip, 20000},
    {"directory", fuzzDirectory, 20000},
    {"spacemouse", fuzzSpaceMouse, 20000},
    {"haply", fuzzHaply, 10000},
    {"bridge", fuzzBridge, 20000},
    {"tile", fuzzTile, 20000},
    {"text", fuzzText, 20000},
    {"placements", fuzzPlacements, 20000},
    {"request", fuzzRequest, 20000},
    {"session", fuzzSession, 20000},
    {"hdf5", fuzzHdf5, 20000},
    {"packed", fuzzPacked, 10000},
    {"json", fuzzJson, 20000},
    {"properties", fuzzProperties, 20000},
    {"nml", fuzzNml, 10000},
    {"csv", fuzzCsv, 20000},
    {"asc", fuzzAsc, 20000},
    {"shard", fuzzShard, 20000},
};

// Aborts if a promise is broken.
inline void require(bool kept, const char* promise) {
  if (kept) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

}  // namespace filiform::fuzz
