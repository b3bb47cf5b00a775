// Limits a computed force before it goes to the device: clamp, slew limit, fade and ramp, and zero if no force may act.
// The result depends only on the inputs and on earlier calls: the gate uses neither a clock nor a device.
//
//   ForceGate gate(options);
//   Wrench sent = gate.pass({.wanted = wrench, .dt_s = dt_s});     // once a tick
//   gate.close();     // zero now; later force grows from zero over the ramp
//   gate.restart();   // what is sent now fades to zero; then force grows from zero over the ramp
//
// Two gates act in a row. The force law's gate applies clamp, slew limit, and fade and ramp at a command. The haptic
// loop's gate sends zero for a stale state, while force is withheld and after an interruption, and fades the force at
// the end of the loop. Thread rule: haptic thread only; a copy is a snapshot of the whole state.
#pragma once

#include "device/haptic_device.h"

#include <cstdint>
#include <limits>

#include <Eigen/Core>

namespace filiform {

struct ForceGateOptions {
  double max_force_N = std::numeric_limits<double>::infinity();   // > 0; a longer force is shortened, direction kept
  double max_slew_N_s = std::numeric_limits<double>::infinity();  // > 0; limits increases; a fall is never delayed
  double ramp_s = 0.5;                                            // >= 0; time from zero to the whole force
  double fade_s = 0.05;                                           // >= 0; time from the whole force to zero
  double max_fade_N_s = 100;                                      // > 0; a strong force takes longer to fade
};

class ForceGate {
 public:
  struct Input {
    Wrench wanted{};
    double dt_s = 0;    // since the last call; counts as 0 unless > 0 and finite
    double free_N = 0;  // >= 0; increase that the hand's own motion causes; the slew limit does not apply to it
    // The force is zero unless the device is ready, and its state is not stale, and force is not withheld. A stale
    // state and withheld force also restart the ramp.
    bool ready = true, stale = false, withheld = false;
  };
  struct Events {  // numbers of calls since construction
    std::uint64_t clamped = 0, slewed = 0;
  };

  // Throws UsageError for an option that is out of range or NaN. `open`: the first force passes whole; otherwise it
  // grows over the ramp.
  explicit ForceGate(const ForceGateOptions& options, bool open = false);

  // Returns the wrench to send now. It is finite, and zero if the wanted wrench is not. Its force is at most
  // max_force_N long, and exceeds the last force by at most (max_slew_N_s + max_force_N / ramp_s) dt_s + free_N. During
  // a fade it exceeds neither the rest of the fading force nor the force sent last. O(1), no allocation.
  Wrench pass(const Input& input) noexcept;
  // Returns zero. The next force starts at zero; the ramp continues.
  Wrench cut() noexcept;
  // Returns zero. The next force grows from zero over the ramp.
  Wrench close() noexcept;
  // Lets the force sent last fall to zero over fade_s, or over |force| / max_fade_N_s if that is longer. The next force
  // then grows over the ramp.
  void restart() noexcept;

  bool fading() const noexcept { return fade_s_ > 0; }
  // The fading force `dt_s` from now; zero at the end of the fade. Requires fading().
  Eigen::Vector3d faded_N(double dt_s) const noexcept;

  const Wrench& sent() const noexcept { return sent_; }
  const Events& events() const noexcept { return events_; }
  const ForceGateOptions& options() const noexcept { return options_; }

 private:
  double partOf(double dt_s) const noexcept;  // the part (0..1) of the fading force that remains after dt_s

  ForceGateOptions options_;
  Events events_;
  Wrench sent_;
  Eigen::Vector3d slewed_N_ = Eigen::Vector3d::Zero();  // the last force before the ramp
  Eigen::Vector3d fading_N_ = Eigen::Vector3d::Zero();
  double fade_s_ = 0, faded_s_ = 0;  // duration of the fade (0: none); time since its start
  double ramped_s_ = 0;
  bool ramp_begun_ = false;
};

}  // namespace filiform
