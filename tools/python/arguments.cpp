#include "tools/python/internal/arguments.h"

#include "index/errors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>

namespace filiform::python {

namespace {

std::string typeName(py::handle value) { return Py_TYPE(value.ptr())->tp_name; }

// Replaces the Python error that is set by one of the same type, with the argument's name.
[[noreturn]] void rethrowNamed(const char* name, py::error_already_set& error) {
  const std::string text = std::string(name) + ": " + py::str(error.value()).cast<std::string>();
  if (error.matches(PyExc_TypeError)) throw py::type_error(text);
  if (error.matches(PyExc_ValueError) || error.matches(PyExc_OverflowError)) throw py::value_error(text);
  throw error;
}

std::string shapeText(const py::array& array) { return py::str(array.attr("shape")).cast<std::string>(); }

py::array doubles(const char* name, py::handle value) {
  using Doubles = py::array_t<double, py::array::c_style>;
  if (py::isinstance<Doubles>(value)) {
    auto array = py::reinterpret_borrow<py::array>(value);
    if ((array.flags() & py::detail::npy_api::NPY_ARRAY_ALIGNED_) != 0) return array;
  }
  try {
    // Asked for without a type first: text and complex numbers must not be converted silently.
    const py::module_ numpy = py::module_::import("numpy");
    const py::array any = numpy.attr("asarray")(value);
    const char kind = any.dtype().kind();
    if (std::string_view("biuf").find(kind) == std::string_view::npos)
      throw py::type_error(std::string(name) + ": expected numbers, got an array of dtype " +
                           py::str(any.dtype()).cast<std::string>());
    return numpy.attr("require")(any, "f8", "CA");
  } catch (py::error_already_set& error) {
    rethrowNamed(name, error);
  }
}

}  // namespace

PointsArgument pointsArgument(const char* name, py::handle value) {
  PointsArgument argument;
  argument.array = doubles(name, value);
  const py::array& array = argument.array;
  if (array.ndim() < 1 || array.shape(array.ndim() - 1) != 3) {
    const bool is_turned = array.ndim() == 2 && array.shape(0) == 3;
    throw py::value_error(std::string(name) + ": expected shape (3,) or (..., 3), got " + shapeText(array) +
                          (is_turned ? "; transpose it with .T" : ""));
  }
  argument.outer_shape.assign(array.shape(), array.shape() + array.ndim() - 1);
  static_assert(sizeof(Vector3d) == 3 * sizeof(double));
  argument.points = {static_cast<const Vector3d*>(array.data()), static_cast<std::size_t>(array.size()) / 3};
  for (std::size_t i = 0; i < argument.points.size(); ++i)
    if (!argument.points[i].allFinite())
      throw py::value_error(std::string(name) + (argument.outer_shape.empty() ? "" : ": point " + std::to_string(i)) +
                            ": coordinates must be finite (found nan or inf)");
  return argument;
}

Vector3d pointArgument(const char* name, py::handle value) {
  const py::array array = doubles(name, value);
  if (array.ndim() != 1 || array.shape(0) != 3)
    throw py::value_error(std::string(name) + ": expected shape (3,), got " + shapeText(array));
  return pointsArgument(name, array).points[0];
}

double numberArgument(const char* name, py::handle value) {
  const double number = PyFloat_AsDouble(value.ptr());
  if (number == -1 && PyErr_Occurred() != nullptr) {
    PyErr_Clear();
    throw py::type_error(std::string(name) + ": expected a number, got " + typeName(value));
  }
  if (std::isnan(number)) throw py::value_error(std::string(name) + ": must not be nan");
  return number;
}

std::int64_t integerArgument(const char* name, py::handle value) {
  const auto index = py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr()));
  if (!index) {
    PyErr_Clear();
    throw py::type_error(std::string(name) + ": expected an integer, got " + typeName(value));
  }
  int overflow = 0;
  const long long number = PyLong_AsLongLongAndOverflow(index.ptr(), &overflow);
  if (overflow != 0) throw py::value_error(std::string(name) + ": is out of range");
  return number;
}

std::uint64_t countArgument(const char* name, py::handle value, std::uint64_t least) {
  const std::int64_t number = integerArgument(name, value);
  if (number < 0 || static_cast<std::uint64_t>(number) < least)
    throw py::value_error(std::string(name) + ": must be " + std::to_string(least) + " or more");
  return static_cast<std::uint64_t>(number);
}

unsigned workersArgument(py::handle value) {
  const std::int64_t number = integerArgument("workers", value);
  if (number == -1) return std::max(1u, std::thread::hardware_concurrency());
  if (number < 1) throw py::value_error("workers: give a number of threads, or -1 for one a processor");
  return static_cast<unsigned>(std::min<std::int64_t>(number, 1024));
}

RanksArgument ranksArgument(py::handle value) {
  RanksArgument argument;
  if (PyIndex_Check(value.ptr()) != 0 && !py::isinstance<py::array>(value)) {
    argument.count = countArgument("k", value, 1);
    argument.single = argument.count == 1;
    return argument;
  }
  if (PySequence_Check(value.ptr()) == 0 || PyUnicode_Check(value.ptr()) != 0)
    throw py::type_error("k: expected an integer or a sequence of integers, got " + typeName(value));
  for (const py::handle item : py::reinterpret_borrow<py::object>(value)) {
    argument.ranks.push_back(countArgument("k", item, 1) - 1);
    argument.count = std::max(argument.count, argument.ranks.back() + 1);
  }
  if (argument.ranks.empty()) throw py::value_error("k: the sequence of ranks is empty");
  return argument;
}

}  // namespace filiform::python
