// RangeAhead: notices when a file is read piece after piece, and says how much to fetch at once.
//
// A read continues a run if it begins where the read before it, of the same file, ended. From the third read of a run
// on, more is fetched than asked for: 64 KiB, then twice as much each time, up to 1 MiB. The rest serves later reads.
// Other reads fetch what they ask for. One piece is kept at a time.
#pragma once

#include "index/file/internal/bytes.h"

#include <cstdint>
#include <map>
#include <mutex>
#include <span>
#include <string>

namespace filiform::internal {

// Thread rule: internally synchronised.
class RangeAhead {
 public:
  static constexpr std::uint64_t kFirst = 64 << 10, kMost = 1 << 20;

  // Fills `bytes` from the piece that is kept; false if it does not hold all of them.
  bool take(const std::string& file, std::uint64_t offset, std::span<std::uint8_t> bytes);
  // How many bytes to fetch at `offset` for a read of `bytes`, in a file of `file_bytes`: at least `bytes`.
  std::uint64_t plan(const std::string& file, std::uint64_t offset, std::uint64_t bytes, std::uint64_t file_bytes);
  // Keeps a piece that was fetched, in place of the one before.
  void keep(const std::string& file, std::uint64_t offset, Bytes piece);
  // Forgets the piece that is kept, and all runs.
  void forget();

 private:
  struct Run {
    std::uint64_t next = UINT64_MAX;  // where the last read ended
    int reads = 0;
    std::uint64_t ahead = kFirst;
  };
  std::mutex mutex_;  // guards the members below
  std::map<std::string, Run> runs_;
  std::string file_;
  std::uint64_t offset_ = 0;
  Bytes piece_;
};

}  // namespace filiform::internal
