// What the errors of filiform become in Python.
#include "index/errors.h"

#include "device/haptic_device.h"
#include "tools/python/internal/bindings.h"

namespace filiform::python {

namespace py = pybind11;

void addErrors(py::module_& module) {
  // Kept for the life of the process: translators outlive the module's dictionary.
  static PyObject* const corrupt = PyErr_NewExceptionWithDoc(
      "filiform.CorruptSet", "The bytes of a set differ from those that were written.", PyExc_Exception, nullptr);
  module.attr("CorruptSet") = py::reinterpret_borrow<py::object>(corrupt);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const CorruptSet& error) {
      PyErr_SetString(corrupt, error.what());
    } catch (const UsageError& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
    } catch (const InputError& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
    } catch (const IoError& error) {
      PyErr_SetString(PyExc_OSError, error.what());
    } catch (const ClosedPipe& error) {
      PyErr_SetString(PyExc_BrokenPipeError, error.what());
    } catch (const Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
    } catch (const Error& error) {
      PyErr_SetString(PyExc_RuntimeError, error.what());
    } catch (const DeviceError& error) {
      PyErr_SetString(PyExc_RuntimeError, error.what());
    }
  });
}

}  // namespace filiform::python
