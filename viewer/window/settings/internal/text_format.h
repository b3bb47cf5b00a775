// Texts of the window. Pure; any thread.
#pragma once

#include <string>
#include <string_view>

namespace filiform::internal {

// As printf does; the result is cut after 255 bytes.
std::string format(const char* pattern, ...) __attribute__((format(printf, 1, 2)));
// The unit of a measure with its letters: `um2` has a Greek one and a small 2.
std::string unitText(std::string_view unit);

}  // namespace filiform::internal
