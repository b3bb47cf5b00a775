// Is the beginning of an input text that can be read, or something else? Pure functions, any thread.
#pragma once

#include <string_view>

namespace filiform::internal {

// Does it begin as compressed data, archives (tar too, if 512 bytes of it are given) and data containers do?
bool hasBinaryMagic(std::string_view head);

// UTF-16 and UTF-32, by their mark or, without one, by NULs at nearly all places of some residue and at nearly none of
// another.
bool isWideText(std::string_view head);

}  // namespace filiform::internal
