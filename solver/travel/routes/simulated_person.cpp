#include "solver/travel/routes/simulated_person.h"

#include "index/errors.h"

#include <algorithm>
#include <cmath>

namespace filiform {

namespace {

constexpr std::uint64_t kAimErrorStream = 0x61696d6572726f72u;

}  // namespace

const char* toString(PersonStatus status) {
  switch (status) {
    case PersonStatus::travelling:
      return "travelling";
    case PersonStatus::pushing:
      return "pushing";
    case PersonStatus::backing_off:
      return "backing off";
    case PersonStatus::arrived:
      return "arrived";
    case PersonStatus::gave_up:
      return "gave up";
  }
  return "unknown";
}

SimulatedPerson::SimulatedPerson(const Route& route, const PersonParameters& parameters, std::uint64_t seed)
    : route_(route), parameters_(parameters), random_(seed), tracker_(route) {
  const PersonParameters& p = parameters;
  for (const double x : {p.speed_m_s, p.lookahead_m, p.arrive_m, p.progress_m, p.stuck_after_s, p.push_speed_m_s,
                         p.push_most_m, p.hold_s, p.back_off_s, p.tremor_time_s})
    if (!(x > 0 && std::isfinite(x)))
      throw UsageError("the simulated person's speed, distances and times must be finite and > 0");
  for (const double x : {p.tail_m, p.tremor_rms_m, p.aim_error_m})
    if (!(x >= 0 && std::isfinite(x)))
      throw UsageError("the simulated person's tail, tremor and aim error must be finite and >= 0");
  if (p.tries < 1) throw UsageError("the simulated person needs at least one try");
  std::mt19937_64 random(seed ^ kAimErrorStream);  // separate stream: the tremor does not depend on the aim error
  const auto sign = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  const double x = 0.5 * sign(), y = 0.5 * sign();
  aim_error_m_ = p.aim_error_m * Eigen::Vector3d(x, y, sign() < 0 ? -1 : 1).normalized();
}

// A sum of twelve uniform numbers: mean 0, variance 1, within +-6. Exact in doubles, so no mathematical library is
// needed.
double SimulatedPerson::normal() noexcept {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += static_cast<double>(random_() >> 11) * 0x1p-53;
  return sum;
}

void SimulatedPerson::decide(const Route::Progress& seen, double scale_um_m, double dt_s) noexcept {
  const PersonParameters& p = parameters_;
  if (status_ == PersonStatus::arrived || status_ == PersonStatus::gave_up) return;
  if (seen.on_route && seen.arc_um >= route_.length_um() - p.arrive_m * scale_um_m) {
    status_ = PersonStatus::arrived;
    return;
  }
  if (status_ == PersonStatus::backing_off) {
    phase_s_ += dt_s;
    if (phase_s_ < p.back_off_s) return;
    status_ = PersonStatus::travelling;
    aim_um_ = seen.arc_um;
    best_um_ = seen.arc_um;
    push_m_ = phase_s_ = no_progress_s_ = 0;
    straight_ = tries_ % 2 == 1;
    return;
  }
  // Within a try, returning to an earlier point is progress. Only an advance beyond all tries resets the count of
  // tries.
  no_progress_s_ += dt_s;
  const double progress_um = p.progress_m * scale_um_m;
  if (seen.arc_um >= best_um_ + progress_um) {
    best_um_ = seen.arc_um;
    no_progress_s_ = phase_s_ = 0;
  }
  if (seen.on_route && seen.arc_um >= furthest_um_ + progress_um) {
    furthest_um_ = seen.arc_um;
    tries_ = 0;
  }
  if (no_progress_s_ < p.stuck_after_s) {
    status_ = PersonStatus::travelling;
    push_m_ = std::max(0.0, push_m_ - p.speed_m_s * dt_s);
    return;
  }
  status_ = PersonStatus::pushing;
  push_m_ = std::min(p.push_most_m, push_m_ + p.push_speed_m_s * dt_s);
  if (push_m_ < p.push_most_m) return;
  phase_s_ += dt_s;
  if (phase_s_ < p.hold_s) return;
  phase_s_ = 0;
  ++tries_;
  ++back_offs_;
  status_ = tries_ >= p.tries ? PersonStatus::gave_up : PersonStatus::backing_off;
}

Eigen::Vector3d SimulatedPerson::target_D(const ProxyPlace& proxy, const Workspace& workspace, double dt_s) noexcept {
  const PersonParameters& p = parameters_;
  const double dt = std::isfinite(dt_s) && dt_s > 0 ? dt_s : 0.0;
  const double scale_um_m = workspace.scale_um_m();
  const Route::Progress seen = tracker_.update(proxy);
  decide(seen, scale_um_m, dt);

  // Every second try pulls straight on from the proxy, or from off the route back to it, instead of further along the
  // route. So does the part of the push that is past the tip.
  const double along_m = straight_ ? (seen.on_route ? p.lookahead_m : 0.0) : p.lookahead_m + push_m_;
  const double most_um = route_.length_um() + p.tail_m * scale_um_m;
  const double wanted_um = seen.arc_um + along_m * scale_um_m;
  const double past_m = straight_ ? push_m_ : std::clamp((wanted_um - most_um) / scale_um_m, 0.0, push_m_);
  const double step_um = p.speed_m_s * scale_um_m * dt;
  aim_um_ += std::clamp(std::min(wanted_um, most_um) - aim_um_, -step_um, step_um);

  const Eigen::Vector3d proxy_D = workspace.toDevice(proxy.p_W);
  Eigen::Vector3d aim_D = workspace.toDevice(route_.pointAt(aim_um_));
  const Eigen::Vector3d ahead_D = aim_D - proxy_D;
  if (const double length = ahead_D.norm(); past_m > 0 && length > 0) aim_D += past_m / length * ahead_D;
  aim_D += aim_error_m_;
  if (status_ == PersonStatus::backing_off) {
    const double back = std::min(1.0, phase_s_ / p.back_off_s);
    aim_D += back * (proxy_D - aim_D);
  }

  if (p.tremor_rms_m > 0) {
    // a = exp(-dt/T) by its (1,1) Pade approximant; any |a| < 1 keeps the variance exactly.
    const double half = 0.5 * dt / p.tremor_time_s;
    const double a = trembles_ ? (1 - half) / (1 + half) : 0.0;
    const double b = p.tremor_rms_m * std::sqrt(1 - a * a);
    for (int axis = 0; axis < 3; ++axis) tremor_m_[axis] = a * tremor_m_[axis] + b * normal();
    trembles_ = true;
    aim_D += tremor_m_;
  }
  const WorkspaceOptions& box = workspace.options();
  return aim_D.cwiseMax(box.lo_D).cwiseMin(box.hi_D);
}

}  // namespace filiform
