// RemoteHand: the haptic device of a client, seen through its HAND frames.
//
// The newest HAND wins. Between HANDs the position is interpolated (hand_path.h), then held. If none comes for the hold
// time, the device counts as not ready: the force is zero and grows over the ramp when HANDs come again. HANDs whose
// values are not finite or beyond 10 m are refused: they change nothing.
//
// Thread rule: one thread calls receive(), one exchanges; block() and refused(): any thread.
#pragma once

#include "device/haptic_device.h"
#include "index/triple_buffer.h"
#include "tools/serve/session/hand_path.h"
#include "tools/serve/session/protocol.h"

#include <atomic>
#include <cstdint>

namespace filiform::tools {

struct RemoteHandOptions {
  Eigen::Vector3d lo_D{-0.06, -0.06, -0.06}, hi_D{0.06, 0.06, 0.06};  // the device's box, m
  double hold_s = 0.1;
  double peak_force_N = 8;
};

// A HAND as the ticking thread has taken it.
struct UsedHand {
  v1::Hand hand;
  std::uint64_t tick = 0;  // at which it was first used; 0: none yet
};

class RemoteHand final : public HapticDevice {
 public:
  static constexpr double kPeriod_s = 0.001, kMost_m = 10;

  explicit RemoteHand(const RemoteHandOptions& options);

  // False if the HAND is refused.
  bool receive(const v1::Hand& hand) noexcept;
  static bool isUsable(const v1::Hand& hand) noexcept;
  std::uint64_t refused() const noexcept { return refused_.load(std::memory_order_relaxed); }
  // The force must be zero: a tile cannot be read.
  void block(bool blocked) noexcept { blocked_.store(blocked, std::memory_order_relaxed); }

  // The ticking thread. The next exchange is that of this period, from 1; periods may be left out.
  void beginPeriod(std::uint64_t period) noexcept { period_ = period; }
  // The newest HAND that the last exchange used; whether it used it for the first time; whether HANDs have ceased.
  const UsedHand& used() const noexcept { return used_; }
  bool isFresh() const noexcept { return fresh_; }
  bool isSilent() const noexcept { return silent_; }
  bool isBlocked() const noexcept { return was_blocked_; }

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return state_.status; }
  void open() override;
  void close() noexcept override;
  DeviceState exchange(const Wrench& wrench) noexcept override;

 private:
  DeviceCapabilities capabilities_;
  std::uint64_t hold_ticks_, period_ = 0;
  TripleBuffer<v1::Hand> newest_;
  std::atomic<std::uint64_t> refused_{0};
  std::atomic<bool> blocked_{false};
  HandPath path_;
  UsedHand used_;
  bool fresh_ = false, silent_ = true, was_blocked_ = false;
  DeviceState state_;
};

}  // namespace filiform::tools
