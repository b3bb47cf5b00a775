// Travelling in Python one tick at a time: the caller is the device.
#include "index/errors.h"
#include "solver/travel/session/stepped_travel.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/set_handle.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <pybind11/stl.h>
#include <string>
#include <unistd.h>
#include <utility>

namespace filiform::python {

namespace {

py::array vectorOf(const Vector3d& v) { return py::array_t<double>(3, v.data()); }

double positive(const char* name, py::handle value) {
  const double number = numberArgument(name, value);
  if (!(number > 0)) throw py::value_error(std::string(name) + ": must be above 0");
  return number;
}

class PythonTravel {
 public:
  PythonTravel(SetHandle& handle, bool realtime, const std::string& method, py::handle zoom, py::handle rate,
               py::handle stiffness, py::handle max_force, std::optional<std::uint64_t> budget)
      : open_(handle.get()), process_(getpid()) {
    SteppedTravelOptions options{.realtime = realtime,
                                 .method = solverMethod(method),
                                 .zoom_um = positive("zoom", zoom),
                                 .rate_Hz = positive("rate", rate),
                                 .stiffness_N_m = positive("stiffness", stiffness),
                                 .max_force_N = positive("max_force", max_force),
                                 .budget_bytes = budget};
    const py::gil_scoped_release released;
    travel_ = std::make_unique<SteppedTravel>(open_->set(), options);
  }
  ~PythonTravel() {
    if (process_ != getpid()) travel_.release();  // its threads exist only in the parent
  }
  PythonTravel(const PythonTravel&) = delete;
  PythonTravel& operator=(const PythonTravel&) = delete;

  void close() {
    if (process_ != getpid() || !travel_) return;
    use([&](SteppedTravel&) {});  // raises while another thread is in a call
    travel_.reset();
  }

  // To a segment, or to the nearest one of all.
  void jump(py::handle point, std::optional<std::pair<std::uint32_t, std::uint32_t>> wanted) {
    const Vector3d p_W = pointArgument("place", point);
    use([&](SteppedTravel& travel) {
      std::vector<NearestResult> found;
      if (wanted) {
        SegmentFilter filter;
        filter.cells.emplace(1, wanted->first);
        constexpr std::size_t kAtAPlace = 256;  // segments that meet in a point
        found = open_->filtered().with(filter)->find(p_W, {.k = kAtAPlace, .max_distance_um = 1});
        std::erase_if(found, [&](const NearestResult& r) { return r.segment.segment != wanted->second; });
        if (found.empty()) throw UsageError("place: this row is not of a segment of the set that is travelled");
      } else {
        found = open_->nearest().find(p_W);
        if (found.empty()) throw UsageError("place: the set has no segments");
      }
      travel.jump(found[0].tile, found[0].segment, found[0].t);
    });
  }

  // (force_N, proxy_um, hand_um, proxy_m, cell, segment, t, visited, frontier)
  py::tuple tick(py::handle hand, py::handle dt) {
    const Vector3d hand_D = pointArgument("hand", hand);
    const double dt_s = positive("dt", dt);
    const NavigationTick* made = nullptr;
    use([&](SteppedTravel& travel) { made = &travel.tick(hand_D, dt_s); });
    const ProxyPlace& place = travel_->place();
    return py::make_tuple(vectorOf(made->wrench.force_N), vectorOf(made->p_W), vectorOf(made->h_W), vectorOf(made->p_D),
                          place.segment.cell, place.segment.segment, place.t, made->step.visited, made->frontier);
  }

  void apply(const char* name, const NavigationCommand& command) {
    bool done = false;
    use([&](SteppedTravel& travel) { done = travel.apply(command); });
    if (!done) throw py::value_error(std::string(name) + ": must be finite" + (command.factor != 1 ? ", above 0" : ""));
  }

  py::dict residency() {
    using namespace pybind11::literals;
    ResidencyCounters c;
    std::uint64_t budget = 0;
    use([&](SteppedTravel& travel) { c = travel.residency(), budget = travel.budget_bytes(); });
    return py::dict("reads"_a = c.reads, "evictions"_a = c.evictions, "failures"_a = c.failures, "bytes"_a = c.bytes,
                    "peak_bytes"_a = c.peak_bytes, "bytes_read"_a = c.bytes_read_decoded, "misses"_a = c.misses(),
                    "prefetched"_a = c.prefetched, "prefetch_used"_a = c.prefetch_used, "budget_bytes"_a = budget);
  }

  bool isClosed() const { return !travel_; }

 private:
  // Calls without the global lock; one thread at a time.
  template <typename Call>
  void use(const Call& call) {
    if (process_ != getpid()) throw UsageError("travel: opened before fork(); open another in this process");
    if (!travel_) throw UsageError("travel: it is closed");
    if (busy_) throw UsageError("travel: another thread is in a call of this travel");
    struct Busy {  // ends with the global lock held
      explicit Busy(bool& of) : flag(of) { flag = true; }
      ~Busy() { flag = false; }
      bool& flag;
    } const busy(busy_);
    const py::gil_scoped_release released;
    call(*travel_);
  }

  const std::shared_ptr<const OpenSet> open_;
  const pid_t process_;
  std::unique_ptr<SteppedTravel> travel_;
  bool busy_ = false;
};

}  // namespace

void addTravel(py::module_& module) {
  using Kind = NavigationCommand::Kind;
  py::class_<PythonTravel>(module, "TravelData")
      .def(py::init<SetHandle&, bool, const std::string&, py::handle, py::handle, py::handle, py::handle,
                    std::optional<std::uint64_t>>())
      .def("close", &PythonTravel::close)
      .def_property_readonly("closed", &PythonTravel::isClosed)
      .def("jump", &PythonTravel::jump)
      .def("tick", &PythonTravel::tick)
      .def("zoom",
           [](PythonTravel& travel, py::handle factor) {
             travel.apply("factor", {.kind = Kind::zoom, .place = {}, .factor = positive("factor", factor)});
           })
      .def("rotate",
           [](PythonTravel& travel, py::handle x, py::handle y) {
             travel.apply("about_x, about_y", {.kind = Kind::rotate,
                                               .place = {},
                                               .about_x_rad = numberArgument("about_x", x),
                                               .about_y_rad = numberArgument("about_y", y)});
           })
      .def("centre", [](PythonTravel& travel) { travel.apply("centre", {.kind = Kind::centre, .place = {}}); })
      .def("residency", &PythonTravel::residency);
}

}  // namespace filiform::python
