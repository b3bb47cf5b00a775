// verify: checks that a tile set is undamaged and, on request, consistent.
#pragma once

#include "index/remote/remote_options.h"
#include "index/set/tile_set.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform {

// What verify() found.
struct VerifyReport {
  // One line a problem, with file, offset and tile if they apply. After kMaxProblems lines, problems are only counted.
  static constexpr std::size_t kMaxProblems = 100;
  std::vector<std::string> problems;
  std::uint64_t problem_count = 0;
  std::uint64_t tiles = 0, bytes = 0;  // checked
  bool sound() const { return problem_count == 0; }
};

// What verify() checks.
struct VerifyOptions {
  // Also check the content: every segment owned once, every node's home complete, ghosts complete and none unnecessary;
  // boxes, counts and cells in agreement with the segments; landmarks within their radius. Reads each tile twice. Takes
  // half a byte a sample and a few hundred bytes a tile and a cell.
  bool deep = false;
  std::string sha256 = {};                    // compare with setDigest(); empty: do not
  const std::atomic<bool>* cancel = nullptr;  // when true: throw Interrupted
  RemoteOptions remote = {};                  // for an address
  std::function<void(const char* phase, std::uint64_t done, std::uint64_t total)> progress = {};
};

// Checks the digest of every file and the checksum of every tile and cell, and decodes them. Damage is reported as a
// problem. Throws IoError if there is no set or it cannot be read, Interrupted, and what `progress` throws. O(bytes);
// with `deep`: O(stored segments).
VerifyReport verify(const std::string& path, const VerifyOptions& options = {});

}  // namespace filiform
