// Matches names with patterns, in a time that no pattern can blow up. Pure function.
#pragma once

#include <string_view>

namespace filiform {

// True if the whole name matches: `*` stands for any text, `?` for any byte, `[ab]`, `[a-z]`, `[!a]` for one of a list,
// `\` before a character for this character. A `[` without `]` stands for itself. O(pattern * name).
bool matchesGlob(std::string_view pattern, std::string_view name);

// The same for names of cells, which the user need not type in the right letter case.
bool matchesName(std::string_view pattern, std::string_view name);

}  // namespace filiform
