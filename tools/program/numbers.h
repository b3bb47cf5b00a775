// Numbers as people write and read them. Pure functions.
#pragma once

#include <cstdint>
#include <string>

namespace filiform::tools {

// "65536", "64KiB", "1.5 MiB", "1G": K, M, G, T and KiB, MiB, GiB, TiB are powers of 1024; KB (kB), MB, GB, TB powers
// of 1000. Throws UsageError naming `option` and the forms.
std::uint64_t parseBytes(const std::string& option, const std::string& text);
// "64.0 MiB", "312 B".
std::string formatBytes(std::uint64_t bytes);
// 1234567 -> "1 234 567".
std::string formatCount(std::uint64_t count);
// Shortest decimals that read back as the same double.
std::string formatNumber(double value);
// A finite number in full; throws UsageError naming `what` otherwise (NaN, infinite, trailing text).
double parseNumber(const std::string& what, const std::string& text);

}  // namespace filiform::tools
