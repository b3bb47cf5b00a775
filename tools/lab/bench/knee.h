// Where a curve of cost against error bends: beyond it much is paid for little. Function without state.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace filiform::tools {

// The index of the point farthest below the line through the first and the last point, both axes scaled to the curve's
// extent, logarithms where asked for: a curve that falls (or rises) steeply, then slowly. Points that are not finite
// (or not positive on a logarithmic axis) do not count. None where fewer than three count, or none lies below the line
// by more than a tenth of the extent: such a curve has no knee. Requires x and y of one length, x ascending. O(n).
std::optional<std::size_t> kneeOf(const std::vector<double>& x, const std::vector<double>& y, bool x_log, bool y_log);

// The slope of y over x on logarithmic axes, by least squares; NaN for fewer than two positive points.
double logSlope(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace filiform::tools
