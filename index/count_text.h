// Counts in messages. Thread rule: pure functions.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace filiform {

// 1234567 -> "1 234 567".
std::string formatCount(std::uint64_t count);
// "1 cell", "1 234 cells"; `many` if the plural is not `one` with an s.
std::string counted(std::uint64_t count, std::string_view one, std::string_view many = {});

}  // namespace filiform
