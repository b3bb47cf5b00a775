// HandPath: the position of a hand between the HAND frames of a client. It depends only on the positions and on the
// ticks at which they came, so that a replay gives the same bits. Thread rule: thread-compatible; haptic-safe.
#pragma once

#include <algorithm>
#include <cstdint>

#include <Eigen/Core>

namespace filiform::tools {

class HandPath {
 public:
  static constexpr std::uint64_t kMostTicks = 20;  // of a motion from one position to the next

  // A position (m) that is used from this tick on. The hand moves there in a straight line, in as many ticks as passed
  // since the last position, at most kMostTicks. `afresh`: it is there at once.
  void take(const Eigen::Vector3d& h_D, std::uint64_t tick, bool afresh) noexcept {
    from_D_ = afresh ? h_D : at(tick - 1);
    to_D_ = h_D;
    ticks_ = afresh ? 1 : std::clamp<std::uint64_t>(tick - begin_, 1, kMostTicks);
    begin_ = tick;
  }
  // The position at a tick, from that of the last take() on. After the motion the hand stays at its end.
  Eigen::Vector3d at(std::uint64_t tick) const noexcept {
    if (tick + 1 >= begin_ + ticks_) return to_D_;
    if (tick < begin_) return from_D_;
    return from_D_ + (to_D_ - from_D_) * (static_cast<double>(tick + 1 - begin_) / static_cast<double>(ticks_));
  }

 private:
  Eigen::Vector3d from_D_ = Eigen::Vector3d::Zero(), to_D_ = Eigen::Vector3d::Zero();
  std::uint64_t begin_ = 0, ticks_ = 1;
};

}  // namespace filiform::tools
