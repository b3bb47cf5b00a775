// Formats a text as printf does. Pure; any thread.
#pragma once

#include <string>

namespace filiform::internal {

// The result is cut after 255 bytes.
std::string format(const char* pattern, ...) __attribute__((format(printf, 1, 2)));

}  // namespace filiform::internal
