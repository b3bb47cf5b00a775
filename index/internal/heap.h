// Returns freed memory to the system, so that the process takes only what its data need. Without glibc: no effect.
#pragma once

#include <cstddef>

namespace filiform::internal {

// For the whole process, from now on: each block of 1 MiB or more is unmapped as soon as it is freed. By default glibc
// keeps blocks of up to 32 MiB, each thread for itself.
void unmapLargeBlocksWhenFreed() noexcept;

// Brings the pages that lie within these bytes into memory, if the system can do so at once: one call costs less than a
// fault for each page. Their content does not change.
void populate(void* at, std::size_t bytes) noexcept;

// Returns the pages of all freed blocks, of all threads. Cost: milliseconds.
void returnFreedMemory() noexcept;

}  // namespace filiform::internal
