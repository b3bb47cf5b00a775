// Makes system calls fail for a test: the k-th call of a kind, once or from then on. Or the process dies, or stops, at
// that call.
//
//   FailingCalls calls(Kind::sync, {.at = 3});            // applies to all threads
//   try { ingest(...); } catch (const IoError&) {}
//   const std::uint64_t met = calls.end();                // the number of calls
//
// How: the test program defines these functions and calls the C library. Calls within the C library (opendir, fopen)
// are not seen. Memory means `new` under a sanitizer, otherwise malloc and its relatives. Thread rule: one plan at a
// time; calls of all threads count.
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
    std::uint64_t at = 0;   // from 1; 0: no call fails, calls are only counted
    bool for_ever = false;  // this call and all later calls fail
    What what = What::fail;
  };
  // any_file: all kinds except thread and memory.
  FailingCalls(Kind kind, Plan plan) noexcept;
  FailingCalls(const FailingCalls&) = delete;
  FailingCalls& operator=(const FailingCalls&) = delete;
  ~FailingCalls();

  // Ends the plan. Returns the number of calls.
  std::uint64_t end() noexcept;
};

}  // namespace filiform::test
