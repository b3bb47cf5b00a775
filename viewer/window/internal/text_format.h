// printf into a string. Pure; any thread.
#pragma once

#include <string>

namespace filiform::internal {

// Cut after 255 bytes.
std::string format(const char* pattern, ...) __attribute__((format(printf, 1, 2)));

}  // namespace filiform::internal
