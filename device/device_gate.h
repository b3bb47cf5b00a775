// DeviceGate: the limits that a driver puts on each force before it sends it. The force is finite and at most peak_N
// long; it is zero while the device's newest state is old; it grows from zero over a ramp after a start, such a gap or
// a jump.
// `close` it at the start and at a jump; `pass` each force through it.
// Times are of one steady clock. Thread rule: haptic thread only.
#pragma once

#include "device/force_ramp.h"
#include "device/haptic_device.h"
#include "device/vector_length.h"

namespace filiform {

class DeviceGate {
 public:
  static constexpr double kStale_s = 0.010;

  DeviceGate(double peak_N, double ramp_s) : peak_N_(peak_N), ramp_{0, 1, ramp_s} {}

  // From now on the force grows from zero.
  void close(double now_s) noexcept { closed_s_ = now_s; }
  static bool isStale(double now_s, double sampled_s) noexcept { return now_s - sampled_s > kStale_s; }
  // The wrench to send; zero, and the ramp begins anew, if the newest state is older than kStale_s.
  Wrench pass(const Wrench& wanted, double now_s, double sampled_s) noexcept {
    if (isStale(now_s, sampled_s)) {
      close(now_s);
      return {};
    }
    Wrench sent = finiteOrZero(wanted);
    shorten(sent, peak_N_);
    scale(sent, fb_ramp_part(&ramp_, now_s - closed_s_));
    return sent;
  }

  // Shortens the force of a finite wrench to most_N, and scales its model alike. Returns the part that is left.
  static double shorten(Wrench& wrench, double most_N) noexcept {
    const double length_N = lengthOf(wrench.force_N);
    if (!(length_N > most_N)) return 1;
    const double part = most_N / length_N;  // 0 if the length is not finite
    scale(wrench, part);
    return part;
  }
  // Scales the force and its model.
  static void scale(Wrench& wrench, double part) noexcept {
    wrench.force_N *= part;
    wrench.model.stiffness_N_m *= part;
    wrench.model.damping_Ns_m *= part;
  }

 private:
  double peak_N_;
  fb_ramp ramp_;
  double closed_s_ = 0;
};

}  // namespace filiform
