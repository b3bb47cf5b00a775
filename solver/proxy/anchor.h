// The anchor: the point to which the spring pulls if the proxy may jump. The anchor walks to the proxy in a straight
// line, at a limited speed.
//
// It is stored as an offset from the proxy in the device frame D, so zoom and rotation about the proxy do not change
// it. In each tick, with the proxy's motion `moved_D` and the hand at h_D:
//
//   offset -= moved_D                                      the anchor stays at its place in the world
//   step = (speed + min(hand_share |v_h|, most_share)) dt  v_h: the hand's velocity, low-pass filtered over 5 ms
//   offset = 0 if |offset| <= step, else offset shortened by step
//
// Invariants (each has a test), with x = p + offset:
// 1. |x_new - x_old| <= step. So in one tick the spring's force changes by at most K (step + |dh|), however far the
//    proxy jumps.
// 2. |x - h| <= max(|x_old - h|, |p - h|), because distance is convex on a straight line. So a jump of the proxy never
//    raises the energy in the spring.
// 3. With hand and proxy at rest, x = p exactly after the time |p - x| / speed.
//
// The velocity is filtered as a vector, before its length is taken, so that an encoder's noise averages out. Thread
// rule: thread-compatible; a copy is a snapshot of the whole state. All members except the constructor are noexcept and
// do not allocate.
#pragma once

#include "index/errors.h"

#include <Eigen/Core>

namespace filiform {

struct AnchorOptions {
  double speed_m_s = 0.10;  // >= 0; with the hand at rest. 0.02 to 0.2 feel alike
  double hand_share = 1.0;  // >= 0; part of the hand's speed that is added. At 0 a fast hand feels a drag
  // >= 0; upper limit of the added speed. A hand that slips from a full push moves at up to 1 m/s; an anchor that moved
  // as fast would double the jerk.
  double most_share_m_s = 0.2;
};

class Anchor {
 public:
  // Throws UsageError for an option that is out of range or not finite.
  explicit Anchor(const AnchorOptions& options);

  // Puts the anchor at the proxy and forgets the hand's velocity: after a jump, a change of mode or a start.
  void reset() noexcept;
  // One tick. Returns the offset (m, frame D). If an argument is not finite, the offset is zero. A dt_s that is not > 0
  // and finite counts as 0. O(1).
  const Eigen::Vector3d& advance(const Eigen::Vector3d& moved_D, const Eigen::Vector3d& h_D, double dt_s) noexcept;

  const Eigen::Vector3d& offset_D() const noexcept { return offset_D_; }
  double hand_speed_m_s() const noexcept { return v_D_.norm(); }
  const AnchorOptions& options() const noexcept { return options_; }

 private:
  AnchorOptions options_;
  Eigen::Vector3d offset_D_ = Eigen::Vector3d::Zero(), h_D_ = Eigen::Vector3d::Zero(), v_D_ = Eigen::Vector3d::Zero();
  bool knows_hand_ = false;
};

}  // namespace filiform
