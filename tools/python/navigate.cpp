// Travelling in Python: a simulated or recorded hand follows a route.
#include "solver/travel/run/run.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/calls.h"
#include "tools/python/internal/set_handle.h"
#include "tools/words/numbers.h"

#include <pybind11/stl.h>
#include <vector>

namespace filiform::python {

struct PythonTick {
  double time;
  std::array<double, 3> hand, proxy, force;
  std::uint32_t cell, segment, visited;
  bool frontier;
};

namespace {

std::array<double, 3> arrayOf(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

py::dict summaryOf(const RunSummary& s) {
  using namespace pybind11::literals;
  return py::dict("outcome"_a = toString(s.outcome), "cell"_a = py::bytes(s.cell), "route_um"_a = s.route_um,
                  "reached_um"_a = s.reached_um, "ticks"_a = s.ticks, "sim_s"_a = s.sim_s, "tiles"_a = s.tiles,
                  "tiles_read"_a = s.tiles_read, "stalls"_a = s.stalls, "frontiers"_a = s.frontiers,
                  "peak_bytes"_a = s.peak_bytes, "mean_force_N"_a = s.mean_force_N, "max_force_N"_a = s.max_force_N,
                  "force_integral_Ns"_a = s.force_integral_Ns, "max_force_step_N"_a = s.max_force_step_N,
                  "visited"_a = s.visited, "legs"_a = s.legs, "legs_completed"_a = s.legs_completed,
                  "stiffness_N_m"_a = s.stiffness_N_m, "notes"_a = s.notes, "failures"_a = s.failures);
}

template <typename T>
std::optional<T> optionalNumber(const char* name, py::handle value) {
  if (value.is_none()) return {};
  return static_cast<T>(numberArgument(name, value));
}

py::tuple navigate(SetHandle& handle, std::optional<std::uint32_t> cell, const std::string& route,
                   const std::string& method, const std::string& device, py::handle seed, py::handle seconds,
                   py::handle zoom, py::handle leap, py::handle rate, py::handle speed, py::handle stiffness,
                   py::handle budget, const std::string& record) {
  RunOptions options;
  options.cell = cell;
  options.route = routeChoiceOf(route);
  options.method = solverMethod(method);
  options.device = device;
  options.seed = countArgument("seed", seed, 0);
  options.seconds = optionalNumber<double>("seconds", seconds);
  options.zoom_um = numberArgument("zoom", zoom);
  options.leap = numberArgument("leap", leap);
  options.rate_Hz = numberArgument("rate", rate);
  if (!(options.rate_Hz > 0 && options.rate_Hz <= 1e6))
    throw py::value_error("rate: give more than 0 and at most 1e6 ticks a second");
  if (const auto speed_m_s = optionalNumber<double>("speed", speed)) options.person.speed_m_s = *speed_m_s;
  options.stiffness_N_m = optionalNumber<double>("stiffness", stiffness);
  if (!budget.is_none()) options.budget_bytes = countArgument("budget", budget, 1);
  options.record = record;
  const auto open = handle.get();
  std::vector<PythonTick> ticks;
  RunSummary summary;
  {
    const py::gil_scoped_release released;
    SignalCheck check;
    summary = run(open->set(), options, [&](const TickRow& row) {
      ticks.push_back({row.time_s, arrayOf(row.h_W), arrayOf(row.p_W), arrayOf(row.force_N), row.segment.cell,
                       row.segment.segment, row.visited, row.frontier});
      check();
    });
  }
  // The rows move into the array: it owns the vector.
  auto* const owned = new std::vector<PythonTick>(std::move(ticks));
  const py::capsule owner(owned, [](void* vector) { delete static_cast<std::vector<PythonTick>*>(vector); });
  py::array_t<PythonTick> array(static_cast<py::ssize_t>(owned->size()), owned->data(), owner);
  return py::make_tuple(std::move(array), summaryOf(summary));
}

}  // namespace

void addNavigate(py::module_& module) {
  PYBIND11_NUMPY_DTYPE(PythonTick, time, hand, proxy, force, cell, segment, visited, frontier);
  module.attr("TICK") = py::dtype::of<PythonTick>();
  module.def("navigate", &navigate);
}

}  // namespace filiform::python
