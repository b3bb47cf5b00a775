// Numbers in command lines and messages. Pure functions.
#pragma once

#include "index/count_text.h"

#include <cstdint>
#include <string>

namespace filiform::tools {

// "65536", "64KiB", "1.5 MiB", "1G". K, M, G, T and KiB, MiB, GiB, TiB are powers of 1024; KB (kB), MB, GB, TB are
// powers of 1000. Throws UsageError, which names `option` and the accepted forms.
std::uint64_t parseBytes(const std::string& option, const std::string& text);
// "64.0 MiB", "312 B".
std::string formatBytes(std::uint64_t bytes);
// The fewest decimals that read back as the same double.
std::string formatNumber(double value);
// Reads a finite number; the whole text must be the number. Throws UsageError, which names `what`, otherwise.
double parseNumber(const std::string& what, const std::string& text);

}  // namespace filiform::tools
