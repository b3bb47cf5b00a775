// Requests of a page's program. The page's reader makes them: viewer/web/page/reader.js, a worker with an event loop.
// Threads of the program do not return to their event loops, and a browser frees what a request has taken only there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace filiform::internal {

// One request and its answer. The reader reads and writes the members at their offsets.
struct PageRequest {
  enum class Method : std::int32_t { get, head, kept };  // kept: the body of the answer before, with room for it

  std::uint32_t next = 0;        // the request that was asked for before this one
  std::int32_t is_answered = 0;  // what ask() waits on
  const char* url = nullptr;     // ends with NUL, as `token` does
  const char* token = nullptr;   // empty: none
  std::uint8_t* to = nullptr;    // where the body goes, if it has at most `room` bytes
  std::uint32_t room = 0;
  Method method = Method::get;
  std::int32_t past_the_cache = 0;  // not from what the browser has kept
  std::uint32_t timeout_ms = 0;
  std::int32_t status = 0;       // 0: no answer
  std::uint32_t body_bytes = 0;  // more than `room`: the reader keeps the body until the next request at this address
  std::uint32_t retry_after_s = 0;
  double stated_bytes = -1;  // the size that the answer states; -1: none
};
static_assert(offsetof(PageRequest, room) == 20 && offsetof(PageRequest, stated_bytes) == 48);

// Waits for the answer. Thread rule: any thread but the page's own.
void ask(PageRequest& request);

}  // namespace filiform::internal
