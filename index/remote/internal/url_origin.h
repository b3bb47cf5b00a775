// The origin of a URL. Thread rule: a pure function.
#pragma once

#include <string>

namespace filiform::internal {

// Scheme, host and port of a URL, in lower case; empty if it is malformed or neither http nor https.
std::string originOf(const std::string& url);

}  // namespace filiform::internal
