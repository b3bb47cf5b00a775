// Independent pieces of work on several threads. Functions without state.
#pragma once

#include <cstddef>
#include <functional>

namespace filiform::tools {

// Calls work(i) for each i < count, in ascending order of beginning, on `threads` threads (at least one); returns when
// all are done. While it waits, `meanwhile` is called on the calling thread about ten times a second; what it or a
// piece of work throws ends the rest and is passed on (of several, any one).
void parallelFor(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& work,
                 const std::function<void()>& meanwhile = {});

}  // namespace filiform::tools
