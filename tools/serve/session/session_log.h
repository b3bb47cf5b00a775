// SessionLog: the frames of a recorded session, FILE.frames beside FILE.rec and FILE.rec.json: each HAND with the tick
// that first used it, and each PROXY with its tick. tools/serve/PROTOCOL.md specifies the file.
//
// Thread rule: the ticking thread calls note(); one other thread calls drain() and finish().
#pragma once

#include "index/output.h"
#include "index/spsc_ring.h"
#include "tools/serve/session/protocol.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace filiform::tools {

struct LogRecord {
  std::uint64_t tick = 0;  // from 1
  std::uint32_t size = 0;  // kHandBytes: HAND; kProxyBytes: PROXY; 1: whether the force is withheld from this tick on
  std::array<unsigned char, v1::kProxyBytes> bytes{};
};

class SessionLog {
 public:
  // `about`: JSON, stored verbatim. Throws as Output does.
  SessionLog(const std::string& path, const std::string& about);

  // Haptic-safe. A record that finds no room is lost; finish() then throws.
  void note(std::uint64_t tick, std::span<const unsigned char> bytes) noexcept;
  // Writes what was noted. Throws IoError.
  void drain();
  // Writes the rest and the closing mark. Throws IoError.
  void finish();

 private:
  Output output_;
  SpscRing<LogRecord> noted_{8192};
  std::atomic<std::uint64_t> lost_{0};
};

struct ReadLog {
  std::string about;
  std::vector<LogRecord> records;  // in the order of ticks
};
// Throws IoError if the file cannot be read, and InputError if it is damaged or cut.
ReadLog readSessionLog(const std::string& path);

}  // namespace filiform::tools
