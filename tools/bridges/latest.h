// SPDX-License-Identifier: MIT
//
// The newest value that one thread tells another: a seqlock. The writer never waits. The reader copies again if the
// writer wrote meanwhile. Thread rule: one writer, one reader.
#pragma once

#include <stdatomic.h>
#include <stdint.h>
#include <string.h>

enum { kLatestWords = 32, kLatestTries = 100 };

struct latest {      // begins as zeros
  atomic_uint turn;  // odd while the writer writes; 0: nothing was written
  _Atomic uint64_t words[kLatestWords];
};

// `size`: at most 8 kLatestWords bytes, the same in all calls.
static inline void latest_write(struct latest* latest, const void* value, size_t size) {
  const unsigned turn = atomic_load_explicit(&latest->turn, memory_order_relaxed);
  uint64_t words[kLatestWords] = {0};
  size_t i;
  memcpy(words, value, size);
  atomic_store_explicit(&latest->turn, turn + 1, memory_order_relaxed);
  for (i = 0; 8 * i < size; ++i) atomic_store_explicit(&latest->words[i], words[i], memory_order_release);
  atomic_store_explicit(&latest->turn, turn + 2, memory_order_release);
}

// Returns 1 and copies the newest value; 0 without a copy, if nothing was written, or the writer was always at work.
static inline int latest_read(struct latest* latest, void* value, size_t size) {
  uint64_t words[kLatestWords];
  int tries;
  for (tries = 0; tries < kLatestTries; ++tries) {
    const unsigned turn = atomic_load_explicit(&latest->turn, memory_order_acquire);
    size_t i;
    if (turn == 0) return 0;
    for (i = 0; 8 * i < size; ++i) words[i] = atomic_load_explicit(&latest->words[i], memory_order_acquire);
    if (turn % 2 != 0 || atomic_load_explicit(&latest->turn, memory_order_relaxed) != turn) continue;
    memcpy(value, words, size);
    return 1;
  }
  return 0;
}
