#include "device/simulated/scripted_path.h"

#include <cmath>
#include <string>
#include <utility>

namespace filiform {

ScriptedPath::ScriptedPath(std::vector<ScriptedPoint> points, double period_s)
    : points_(std::move(points)), period_s_(period_s) {
  if (!std::isfinite(period_s) || period_s <= 0) throw DeviceError("scripted path: the period must be positive");
  if (points_.empty()) throw DeviceError("scripted path: it needs at least one point");
  double last_s = -1;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const ScriptedPoint& point = points_[i];
    const std::string where = "scripted path: point " + std::to_string(i);
    if (!std::isfinite(point.time_s) || !point.p_D.allFinite()) throw DeviceError(where + " is not finite");
    if (point.time_s < 0 || point.time_s <= last_s) throw DeviceError(where + ": times must rise from 0 on");
    last_s = point.time_s;
  }
  capabilities_.name = "scripted path";
  capabilities_.nominal_rate_Hz = 1 / period_s;
  capabilities_.buttons = 32;
  place();
}

void ScriptedPath::open() {
  periods_ = 0;
  next_ = 0;
  state_ = DeviceState();
  state_.status = DeviceStatus::ready;
  place();
}

void ScriptedPath::close() noexcept {
  last_wrench_ = Wrench();
  state_.status = DeviceStatus::closed;
}

void ScriptedPath::place() noexcept {
  state_.time_s = static_cast<double>(periods_) * period_s_;
  while (next_ < points_.size() && points_[next_].time_s <= state_.time_s) ++next_;
  const ScriptedPoint& from = points_[next_ == 0 ? 0 : next_ - 1];
  state_.buttons = next_ == 0 ? 0 : from.buttons;
  state_.p_D = from.p_D;
  state_.v_D.setZero();
  if (next_ == 0 || next_ == points_.size()) return;
  const ScriptedPoint& to = points_[next_];
  state_.v_D = (to.p_D - from.p_D) / (to.time_s - from.time_s);
  state_.p_D += state_.v_D * (state_.time_s - from.time_s);
}

DeviceState ScriptedPath::exchange(const Wrench& wrench) noexcept {
  const bool ready = state_.status == DeviceStatus::ready;
  last_wrench_ = ready ? finiteOrZero(wrench) : Wrench();
  state_.sent_N = last_wrench_.force_N;
  if (ready) {
    ++periods_;
    place();
  }
  return state_;
}

}  // namespace filiform
