// The module filiform._core: the rooms index and solver for Python. The package filiform documents it.
#include "tools/python/internal/bindings.h"

#include <string>

namespace {

namespace py = pybind11;

// One line, before the arrays of pybind11 fail on NumPy with a text that names nothing.
void requireNumpy() {
  constexpr bool kReadsNumpy2 = PYBIND11_VERSION_HEX >= 0x020C0000;
  const std::string install = kReadsNumpy2 ? "pip install numpy" : "pip install \"numpy<2\"";
  std::string version;
  try {
    version = py::str(py::module_::import("numpy").attr("__version__"));
  } catch (const py::error_already_set&) {
    throw py::import_error("filiform needs NumPy, which is not installed: " + install);
  }
  if (std::stoi(version) >= 2 && !kReadsNumpy2)
    throw py::import_error("this build of filiform needs NumPy 1, and NumPy " + version + " is installed: " + install);
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  requireNumpy();
  module.doc() = "The compiled part of filiform. Use the package filiform.";
  module.attr("version") = FILIFORM_VERSION;
  filiform::python::addErrors(module);
  filiform::python::addSet(module);
  filiform::python::addQueries(module);
  filiform::python::addSegments(module);
  filiform::python::addAttributes(module);
  filiform::python::addMeasures(module);
  filiform::python::addContacts(module);
  filiform::python::addCell(module);
  filiform::python::addLevels(module);
  filiform::python::addNavigate(module);
  filiform::python::addTravel(module);
  filiform::python::addIngest(module);
}
