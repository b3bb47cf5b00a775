// How tile sets are read over HTTP. Thread rule: values.
#pragma once

#include "index/errors.h"
#include "index/file/remote_counters.h"

#include <atomic>
#include <cstdint>
#include <string>

namespace filiform {

struct RemoteOptions {
  std::string token{};  // sent as `Authorization: Bearer`, only to the scheme, host and port of the set; empty: none
  std::string cache_folder{};  // what is read stays here, for this and other processes; empty: nothing is kept
  std::uint64_t cache_bytes = std::uint64_t{4} << 30;  // of that folder; see index/README.md
  // Requests at once, 1..64. Bulk work (tiles_ahead.h) uses at most half of them, a sixteenth beside other reads.
  unsigned connections = 32;
  // Bytes of a block of the set's directory; less than 4 KiB counts as 4 KiB. Larger blocks need fewer requests;
  // smaller blocks arrive sooner over a slow line. Blocks of more than 1 MiB are not kept in the cache's folder.
  std::uint64_t directory_block_bytes = 256 << 10;
  double deadline_s =
      20;                // no retry after this time since a read began; each attempt may take as long, plus 1 s/64 KiB
  unsigned stall_s = 5;  // a transfer without a byte for this time is given up, and tried again
  const std::atomic<bool>* cancel = nullptr;  // when true: reads throw Interrupted
};

}  // namespace filiform
