// The open files of a server: its sets and its clients share the system's limit. Functions without state.
#pragma once

#include <cstddef>

namespace filiform::tools {

// The files of a set that may stay open, if a process may open `limit` files: an equal part of what the clients leave.
// Throws UsageError, which says what fits, if that is less than eight a set.
std::size_t filesOfSet(std::size_t limit, std::size_t sets, std::size_t clients);

// Raises the limit of the process as far as the system allows, and returns it.
std::size_t raiseOpenFiles();

}  // namespace filiform::tools
