// What pushSet() and tidySet() share of a set in an object store. Thread rule: as HttpClient.
#pragma once

#include "index/remote/internal/http_client.h"
#include "index/remote/internal/remote_address.h"

#include <string>

namespace filiform::internal {

// In the folder of a revision that tidySet() is removing.
inline constexpr const char* kRemovalMark = "being-removed";

// The revision that CURRENT at the address names; empty: there is no CURRENT, or the keys may not read it. Throws
// InputError if CURRENT names no revision; IoError.
std::string currentAt(HttpClient& client, const RemoteAddress& address);

}  // namespace filiform::internal
