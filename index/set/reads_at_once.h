// How many reads of a set may be under way at once with profit; each waits on a thread of its own. Thread rule: any
// thread.
#pragma once

#include "index/file/read_threads.h"
#include "index/set/tile_store.h"

#include <atomic>
#include <memory>
#include <unistd.h>

namespace filiform {

// 1 for a set in memory or in a folder.
unsigned readsAtOnce(const TileStore& store);

// Threads for the reads of a set at an address that one purpose begins ahead: each tile in two parts.
unsigned mostReadThreads();
// As many threads, for all reads of the process that are begun ahead. They start when they are first needed. A forked
// process has none of its parent's threads, and gets its own.
inline ReadThreads& readThreads() {
  struct OfProcess {
    pid_t process = getpid();
    ReadThreads threads{mostReadThreads()};
  };
  static std::atomic<OfProcess*> current{nullptr};
  static const struct AtExit {
    ~AtExit() {
      OfProcess* const last = current.exchange(nullptr);
      if (last != nullptr && last->process == getpid()) delete last;
    }
  } at_exit;
  OfProcess* known = current;
  if (known == nullptr || known->process != getpid()) {
    auto made = std::make_unique<OfProcess>();
    if (current.compare_exchange_strong(known, made.get())) known = made.release();
  }
  return known->threads;
}

}  // namespace filiform
