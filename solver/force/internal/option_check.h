// What options of the law and of its passivity are checked with.
#pragma once

#include "index/errors.h"

#include <cmath>
#include <string>

namespace filiform::internal {

// Throws UsageError with the option, its value and what it must be.
inline void require(bool ok, const char* option, double value, const char* range) {
  if (!ok) throw UsageError(std::string(option) + " is " + std::to_string(value) + "; it must be finite and " + range);
}

inline bool isPositive(double x) { return std::isfinite(x) && x > 0; }
inline bool isNotNegative(double x) { return std::isfinite(x) && x >= 0; }

}  // namespace filiform::internal
