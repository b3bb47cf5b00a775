// RemoteCounters: what was asked of a server. Thread rule: a value.
#pragma once

#include <cstdint>

namespace filiform {

// What was asked of the server so far.
struct RemoteCounters {
  std::uint64_t requests = 0;  // retries and redirects included
  std::uint64_t retries = 0;
  std::uint64_t merged = 0;  // reads that were served by the request of another read
  std::uint64_t bytes = 0;   // of bodies, as received
  std::uint64_t cache_hits = 0;
  bool lost = false;    // the newest attempts found no server, or no answer in time
  double silent_s = 0;  // no answer for this time, though reads wait or the server is lost; 0: answers come
};

}  // namespace filiform
