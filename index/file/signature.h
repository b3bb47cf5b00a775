// The signature of a text with a key: HMAC-SHA-256. Its digest: SHA-256. Functions without state.
#pragma once

#include <string>
#include <string_view>

namespace filiform {

// 64 hexadecimal digits in lower case. Throws std::bad_alloc. O(length of both).
std::string signatureOf(std::string_view text, std::string_view key);
// The same without a key.
std::string sha256Digits(std::string_view text);

}  // namespace filiform
