// Calls into the system that fail when a test wants it: the k-th of a kind, once or from then on. Or at which the
// process dies, or stands still.
//
//   FailingCalls calls(Kind::sync, {.at = 3});            // from here on, all threads
//   try { ingest(...); } catch (const IoError&) {}
//   const std::uint64_t met = calls.end();                // how many there were
//
// How: the test program defines these functions itself and hands on to the C library. Calls that the C library makes
// within itself (opendir, fopen) are not seen. Under a sanitizer memory is what `new` gives; else malloc and its kin.
// Thread rule: one plan at a time; calls of all threads count.
#pragma once

#include <cstdint>

namespace filiform::test {

enum class Kind : std::uint8_t { open, read, write, sync, rename, make_folder, thread, memory, any_file };
inline constexpr Kind kKinds[] = {Kind::open,   Kind::read,        Kind::write,  Kind::sync,
                                  Kind::rename, Kind::make_folder, Kind::thread, Kind::memory};
const char* toString(Kind kind);

class FailingCalls {
 public:
  enum class What : std::uint8_t { fail, die, stand_still };
  struct Plan {
    std::uint64_t at = 0;   // from 1; 0: none fails, they are counted
    bool for_ever = false;  // all from that one on
    What what = What::fail;
  };
  // any_file: all kinds but thread and memory.
  FailingCalls(Kind kind, Plan plan) noexcept;
  FailingCalls(const FailingCalls&) = delete;
  FailingCalls& operator=(const FailingCalls&) = delete;
  ~FailingCalls();

  // Lets everything pass again; how many calls there were.
  std::uint64_t end() noexcept;
};

}  // namespace filiform::test
