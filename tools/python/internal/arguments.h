// Arguments of Python as values of C++. Errors name the argument: TypeError for what is no number, ValueError for a
// wrong shape or value. Thread rule: hold Python's global lock.
#pragma once

#include "index/geometry/grid.h"

#include <cstddef>
#include <cstdint>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <span>
#include <string>
#include <vector>

namespace filiform::python {

namespace py = pybind11;

// Points of shape (3,) or (..., 3), um. Without a copy if the array is float64, aligned and contiguous.
struct PointsArgument {
  py::array array;                       // keeps the memory
  std::span<const Vector3d> points;      // finite
  std::vector<py::ssize_t> outer_shape;  // without the last axis; empty for one point
};
PointsArgument pointsArgument(const char* name, py::handle value);
// Requires shape (3,).
Vector3d pointArgument(const char* name, py::handle value);

double numberArgument(const char* name, py::handle value);  // any float; NaN is refused
std::int64_t integerArgument(const char* name, py::handle value);
std::uint64_t countArgument(const char* name, py::handle value, std::uint64_t least);
// The number of threads: -1 is one a processor.
unsigned workersArgument(py::handle value);

// k of scipy: a number of neighbours, or the ranks that are wanted, from 1.
struct RanksArgument {
  std::vector<std::size_t> ranks;  // from 0; empty if `count` says all
  std::size_t count = 1;           // neighbours to find
  bool single = false;             // k = 1: results have no axis for ranks
};
RanksArgument ranksArgument(py::handle value);

}  // namespace filiform::python
