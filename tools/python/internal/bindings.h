// The parts of the modules `_core` and `_render`, one source each. Thread rule: called once, while the module is
// imported.
#pragma once

#include <pybind11/pybind11.h>

namespace filiform::python {

void addErrors(pybind11::module_& module);      // CorruptSet, and what other errors become
void addSet(pybind11::module_& module);         // SetHandle: opening, totals, names of cells
void addQueries(pybind11::module_& module);     // SetHandle: nearest, boxes, rays
void addSegments(pybind11::module_& module);    // all segments in one pass
void addAttributes(pybind11::module_& module);  // SetHandle: columns of values of cells
void addMeasures(pybind11::module_& module);    // SetHandle: morphometrics
void addContacts(pybind11::module_& module);    // SetHandle: where cells come close
void addCell(pybind11::module_& module);
void addLevels(pybind11::module_& module);
void addNavigate(pybind11::module_& module);
void addTravel(pybind11::module_& module);  // tick by tick
void addIngest(pybind11::module_& module);

// The class that addSet() made; addQueries(), addLevels() and addNavigate() add functions that take it.

}  // namespace filiform::python
