// HaplyProof: the steps that prove that the service renders the driver's force. A small force upwards is commanded
// until the states report it, then zero until they report that. The service ignores a command with an unknown name, so
// if the force does not appear, the other name is tried once. Thread rule: haptic thread only.
#pragma once

#include <cstdint>

namespace filiform::internal {

class HaplyProof {
 public:
  enum class Found : std::uint8_t { nothing, begun, other_name, failed, proven };

  // `probe_N`: the force; `most_states`: wait so long for it to be reported.
  HaplyProof(double probe_N, int most_states) : probe_N_(probe_N), most_states_(most_states) {}

  // Before the first proof of a session, which measures the delay.
  void reset() noexcept;
  // Waits for a state of a ready device. The delay stays.
  void wait() noexcept { begin(Phase::waiting); }
  void restart() noexcept;
  // A state of a ready device reports this force upwards (N). Returns what the caller must do now.
  Found take(double reported_N) noexcept;

  double force_N() const noexcept { return phase_ == Phase::with ? probe_N_ : 0; }  // to command upwards
  bool isProven() const noexcept { return phase_ == Phase::proven; }
  bool isWaiting() const noexcept { return phase_ == Phase::waiting; }
  int delay_states() const noexcept { return delay_states_; }  // from a command to the state that reports it

 private:
  enum class Phase : std::uint8_t { waiting, before, with, after, proven };  // the probe's force
  void begin(Phase next) noexcept;
  Found tryOther() noexcept;

  double probe_N_, baseline_N_ = 0;  // baseline: reported without a command
  int most_states_, states_ = 0, tried_ = 0, delay_states_ = 0;
  Phase phase_ = Phase::waiting;
  bool measures_delay_ = true;
};

}  // namespace filiform::internal
