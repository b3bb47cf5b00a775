// Is a tile set what it claims to be?
#pragma once

#include "index/tile_set.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform {

struct VerifyReport {
  // One line each, with file, offset and tile where they apply; after kMaxProblems the rest are only counted.
  static constexpr std::size_t kMaxProblems = 100;
  std::vector<std::string> problems;
  std::uint64_t problem_count = 0;
  std::uint64_t tiles = 0, bytes = 0;  // checked
  bool sound() const { return problem_count == 0; }
};

struct VerifyOptions {
  // Beyond the bytes: every segment owned once, every node's home complete, ghosts complete and none needless, boxes,
  // counts and cells in agreement with the segments, the sample points within their radius. Tile by tile, each read
  // twice; half a byte a sample and a few hundred bytes a tile and a cell are in memory.
  bool deep = false;
  const std::atomic<bool>* cancel = nullptr;  // when it becomes true: Interrupted
  std::function<void(const char* phase, std::uint64_t done, std::uint64_t total)> progress = {};
};

// Checks the digest of every file and the checksum of every tile and cell, and decodes all of them. Damage is a problem
// in the report; throws IoError only when there is no set or it cannot be read. O(bytes); deep: O(stored segments).
VerifyReport verify(const std::string& path, const VerifyOptions& options = {});

}  // namespace filiform
