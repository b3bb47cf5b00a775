// filiform.h: navigation, one tick at a time.
#include "tools/c/open_set.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace filiform::c {

namespace {

SteppedTravelOptions steppedOptionsFrom(const filiform_travel_options& options) {
  SteppedTravelOptions wanted;
  wanted.realtime = options.realtime != 0;
  if (options.method != nullptr) wanted.method = solverMethod(options.method);
  if (options.zoom_um != 0) wanted.zoom_um = options.zoom_um;
  if (options.rate_Hz != 0) wanted.rate_Hz = options.rate_Hz;
  if (options.stiffness_N_m != 0) wanted.stiffness_N_m = options.stiffness_N_m;
  if (options.max_force_N != 0) wanted.max_force_N = options.max_force_N;
  if (options.budget_bytes != 0) wanted.budget_bytes = options.budget_bytes;
  return wanted;
}

// A travel in use by one call.
class HeldTravel {
 public:
  explicit HeldTravel(filiform_travel* travel) : held_(travel, "travel") {
    if (held_->busy.exchange(true, std::memory_order_acquire))
      throw UsageError("travel: another thread is in a call with this handle");
  }
  ~HeldTravel() { held_->busy.store(false, std::memory_order_release); }
  HeldTravel(const HeldTravel&) = delete;
  HeldTravel& operator=(const HeldTravel&) = delete;
  OpenTravel* operator->() const { return &*held_; }

 private:
  Held<OpenTravel, HandleKind::travel> held_;
};

int applyTo(filiform_travel* travel, const NavigationCommand& command, const char* name) {
  return call([&] {
    const HeldTravel held(travel);
    if (!held->travel.apply(command)) throw UsageError(std::string(name) + ": is not finite, or not > 0");
  });
}

void fill(filiform_tick& told, const NavigationTick& tick, const ProxyPlace& place) {
  told.frontier = tick.frontier;
  std::copy_n(tick.wrench.force_N.data(), 3, told.force_N);
  std::copy_n(tick.p_W.data(), 3, told.proxy_um);
  std::copy_n(tick.h_W.data(), 3, told.probe_um);
  std::copy_n(tick.p_D.data(), 3, told.proxy_m);
  told.t = place.t;
  told.cell = place.segment.cell;
  told.segment = place.segment.segment;
  told.visited = tick.step.visited;
}

}  // namespace

}  // namespace filiform::c

using namespace filiform;
using namespace filiform::c;

static_assert(FILIFORM_NONE == UINT32_MAX);

extern "C" {

int filiform_travel_open(filiform_set* set, const filiform_travel_options* options, filiform_travel** travel) {
  return call([&] {
    *required(travel, "travel") = nullptr;
    const HeldSet held(set, "set");
    auto opened = std::make_shared<OpenTravel>(*held, steppedOptionsFrom(optionsOr(options, "options")));
    *travel = static_cast<filiform_travel*>(HandleTable::ofProcess().add(HandleKind::travel, std::move(opened)));
  });
}

int filiform_travel_close(filiform_travel* travel) {
  return call([&] { HandleTable::ofProcess().close(travel, HandleKind::travel, "travel"); });
}

int filiform_travel_jump(filiform_travel* travel, uint32_t cell, filiform_place place) {
  return call([&] {
    const HeldTravel held(travel);
    const TileSet& set = *held->scene->set;
    held->scene->requireCell(cell);
    if (set.cell(cell).removed) throw UsageError("cell " + std::to_string(cell) + ": was removed");
    if (held->jumped_cell != cell) {
      held->jumped = std::make_unique<OpenCell>(readCell(set, cell, false));
      held->jumped_cell = cell;
    }
    const CellPlace at = held->jumped->place(place, "place");
    // The home of a sample has all segments at it.
    held->travel.jump(set.home(held->jumped->paths.graph().positions[at.child]), {cell, at.segment}, at.t);
  });
}

int filiform_travel_jump_to(filiform_travel* travel, const double point_um[3]) {
  return call([&] {
    const HeldTravel held(travel);
    required(point_um, "point_um");
    const auto found = held->scene->nearest.find({point_um[0], point_um[1], point_um[2]});
    if (found.empty()) throw UsageError("the set has no segments");
    held->travel.jump(found[0].tile, found[0].segment, found[0].t);
  });
}

int filiform_travel_tick(filiform_travel* travel, const double hand_m[3], double dt_s, filiform_tick* tick) {
  return call([&] {
    sized(tick, "tick");
    filiform_tick told{};
    told.struct_size = tick->struct_size;
    told.cell = told.segment = FILIFORM_NONE;
    *tick = told;
    required(hand_m, "hand_m");
    const HeldTravel held(travel);
    const NavigationTick& made = held->travel.tick({hand_m[0], hand_m[1], hand_m[2]}, dt_s);
    fill(*tick, made, held->travel.place());
  });
}

int filiform_travel_zoom(filiform_travel* travel, double factor) {
  NavigationCommand command;
  command.kind = NavigationCommand::Kind::zoom;
  command.factor = factor;
  return applyTo(travel, command, "factor");
}

int filiform_travel_rotate(filiform_travel* travel, double about_x_rad, double about_y_rad) {
  NavigationCommand command;
  command.kind = NavigationCommand::Kind::rotate;
  command.about_x_rad = about_x_rad;
  command.about_y_rad = about_y_rad;
  return applyTo(travel, command, "about_x_rad, about_y_rad");
}

int filiform_travel_centre(filiform_travel* travel) {
  NavigationCommand command;
  command.kind = NavigationCommand::Kind::centre;
  return applyTo(travel, command, "centre");
}

int filiform_travel_residency(filiform_travel* travel, filiform_residency* residency) {
  return call([&] {
    const HeldTravel held(travel);
    sized(residency, "residency");
    const ResidencyCounters counters = held->travel.residency();
    filiform_residency told{};
    told.struct_size = residency->struct_size;
    told.reads = counters.reads;
    told.evictions = counters.evictions;
    told.failures = counters.failures;
    told.cancelled = counters.cancelled;
    told.bytes = counters.bytes;
    told.peak_bytes = counters.peak_bytes;
    told.bytes_read = counters.bytes_read_decoded;
    told.queued = counters.queued;
    told.peak_queued = counters.peak_queued;
    told.misses = counters.misses();
    told.prefetched = counters.prefetched;
    told.prefetch_used = counters.prefetch_used;
    told.budget_bytes = held->travel.budget_bytes();
    *residency = told;
  });
}

}  // extern "C"
