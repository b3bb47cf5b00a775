// Files that are no inputs: the formats of neurons that filiform does not read, and how reports count files. Thread
// rule: pure functions, any thread.
#pragma once

#include <string>
#include <string_view>

namespace filiform {

// The name of the format by the ending of a file name, in any letter case: "NEURON" for x.hoc. Empty for other endings.
// O(length).
std::string_view unreadFormat(std::string_view file_name);

// The ending by which reports count a file, in lower case: ".txt"; "no ending" without one, or with one that is longer
// than 12 bytes or not made of letters, digits, `_` and `-`; "._*" for resource forks of macOS. O(length).
std::string countedEnding(std::string_view path);

// Why a file of a folder or an archive was passed over. O(length).
std::string whyPassedOver(std::string_view path);

// Why a file argument of such a format is refused, and what to do; empty for other endings. O(length).
std::string whyNotRead(std::string_view file_name);

}  // namespace filiform
