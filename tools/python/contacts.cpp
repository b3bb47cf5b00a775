// SetHandle in Python: contacts between cells.
#include "index/contacts/contacts.h"

#include "index/set/tile_set.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/calls.h"
#include "tools/python/internal/set_handle.h"
#include "tools/words/contact_rows.h"
#include "tools/words/filter_words.h"

#include <pybind11/stl.h>
#include <string>
#include <utility>
#include <vector>

namespace filiform::python {

namespace {

// Titles and files .npy, by column. `from`, `to`: ascending.
std::vector<std::pair<std::string, py::bytes>> contactArrays(SetHandle& handle, py::handle within_value,
                                                             std::vector<std::uint32_t> from,
                                                             std::vector<std::uint32_t> to, const std::string& types,
                                                             bool surface, py::handle workers_value) {
  ContactOptions options{.within_um = numberArgument("within", within_value),
                         .surface = surface,
                         .from = std::move(from),
                         .to = std::move(to),
                         .threads = workersArgument(workers_value)};
  std::array of_sides = tools::parseTypesOfSides(types, "types");
  options.from_types = std::move(of_sides[0]), options.to_types = std::move(of_sides[1]);
  const auto open = handle.get();
  tools::ContactArrays arrays(open->set());
  {
    const py::gil_scoped_release released;
    SignalCheck check;
    options.check = [&](std::uint64_t, std::uint64_t) { check(); };
    findContacts(open->set(), options, [&](const ContactSite& site) { arrays.add(site); });
  }
  std::vector<std::pair<std::string, py::bytes>> found;
  for (std::size_t i = 0; i < arrays.columns(); ++i) found.emplace_back(arrays.title(i), py::bytes(arrays.npy(i)));
  return found;
}

}  // namespace

void addContacts(py::module_& module) { module.def("contacts", &contactArrays); }

}  // namespace filiform::python
