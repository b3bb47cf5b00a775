// Ids of objects of precomputed skeletons, as people list them. Thread rule: pure functions, any thread.
#pragma once

#include "index/errors.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

// Reads a text with one id a line, decimal digits from 0 to 2^64-1; `#` begins a comment. Throws InputError naming
// `file` and the line of a wrong id, or if there is none. O(length).
std::vector<std::uint64_t> readObjectIds(std::string_view text, const std::string& file);

// Reads one id; false if `text` is none.
bool readObjectId(std::string_view text, std::uint64_t& id);

}  // namespace filiform
