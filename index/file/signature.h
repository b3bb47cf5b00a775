// The signature of a text with a key: HMAC-SHA-256. Function without state.
#pragma once

#include <string>
#include <string_view>

namespace filiform {

// 64 hexadecimal digits in lower case. Throws std::bad_alloc. O(length of both).
std::string signatureOf(std::string_view text, std::string_view key);

}  // namespace filiform
