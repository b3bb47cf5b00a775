// Decides whether an input begins like readable text. Thread rule: pure functions, any thread.
#pragma once

#include <string_view>

namespace filiform::internal {

// True if it begins like compressed data, an archive or a data container. To detect tar, pass 512 bytes.
bool hasBinaryMagic(std::string_view head);

// True for UTF-16 and UTF-32: detected by the byte order mark; by NULs at many even or odd positions only, beside
// characters of text; or by NULs at nearly all positions of one residue and at nearly none of another.
bool isWideText(std::string_view head);

}  // namespace filiform::internal
