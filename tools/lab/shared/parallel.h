// Runs independent pieces of work on several threads. Functions without state.
#pragma once

#include <cstddef>
#include <functional>

namespace filiform::tools {

// Calls work(i) for each i < count on `threads` threads (at least one), beginning in ascending order. Returns when all
// calls have returned. Meanwhile calls `meanwhile` on the calling thread about ten times a second. An exception from
// either function ends the work and propagates (one of them, if there are several).
void parallelFor(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& work,
                 const std::function<void()>& meanwhile = {});

}  // namespace filiform::tools
