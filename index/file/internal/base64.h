// Base64 (RFC 4648, section 4, with padding): bytes inside a text.
#pragma once

#include "index/file/internal/bytes.h"

#include <string>
#include <string_view>

namespace filiform::internal {

// Pure functions, any thread. O(bytes).
std::string toBase64(ByteSpan bytes);
Bytes fromBase64(std::string_view text);  // throws Damage unless toBase64() gives this text

}  // namespace filiform::internal
