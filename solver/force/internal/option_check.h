// Checks of options, for the force law, gates and passivity.
#pragma once

#include "index/errors.h"

#include <cmath>
#include <string>

namespace filiform::internal {

// Throws UsageError with the option's name, its value and the allowed range.
inline void require(bool ok, const char* option, double value, const char* range) {
  if (!ok) throw UsageError(std::string(option) + " is " + std::to_string(value) + "; it must be finite and " + range);
}

inline bool isPositive(double x) { return std::isfinite(x) && x > 0; }
inline bool isNotNegative(double x) { return std::isfinite(x) && x >= 0; }

}  // namespace filiform::internal
