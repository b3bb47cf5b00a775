// The knee of a curve of cost against error: beyond the knee a small gain costs much. Functions without state.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace filiform::tools {

// Returns the index of the knee: the point farthest below the line through the first and the last point. Both axes are
// scaled to the curve's extent, logarithmic where requested. Points that are not finite (or not positive on a
// logarithmic axis) do not count. Returns nullopt if fewer than three points count, or if no point lies below the line
// by more than a tenth of the extent. Requires x and y of equal length, x ascending. O(n).
std::optional<std::size_t> kneeOf(const std::vector<double>& x, const std::vector<double>& y, bool x_log, bool y_log);

// The slope of y over x on logarithmic axes, by least squares; NaN for fewer than two positive points.
double logSlope(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace filiform::tools
