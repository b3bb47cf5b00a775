// What the errors of filiform become in Python.
#include "index/errors.h"

#include "tools/python/internal/bindings.h"
#include "tools/words/library_text.h"

#include <string>
#include <string_view>
#include <utility>

namespace filiform::python {

namespace py = pybind11;

namespace {

std::string inPython(std::string text) {
  static const std::pair<std::string_view, std::string_view> kWords[] = {
      {"--force replaces it", "force=True replaces it"},
      {"make one with filiform ingest", "make one without add=True"},
      {"with --add, --sync and --remove", "with add and sync"},
      {"leave out --add and --remove", "leave out add"},
      {"--remove CELL removes one cell", "filiform.remove() removes one cell"}};
  return tools::inLibraryWords(std::move(text), kWords);
}

}  // namespace

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
      PyErr_SetString(PyExc_ValueError, inPython(error.what()).c_str());
    } catch (const InputError& error) {
      PyErr_SetString(PyExc_ValueError, inPython(error.what()).c_str());
    } catch (const IoError& error) {
      PyErr_SetString(PyExc_OSError, error.what());
    } catch (const ClosedPipe& error) {
      PyErr_SetString(PyExc_BrokenPipeError, error.what());
    } catch (const Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
    } catch (const Error& error) {
      PyErr_SetString(PyExc_RuntimeError, error.what());
    }
  });
}

}  // namespace filiform::python
