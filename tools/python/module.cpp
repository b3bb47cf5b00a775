// The module filiform._core: the rooms index and solver for Python. The package filiform documents it.
#include "tools/python/internal/bindings.h"

PYBIND11_MODULE(_core, module) {
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
