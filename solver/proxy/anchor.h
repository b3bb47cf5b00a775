// The point that the spring pulls to when the proxy may jump: it walks to the proxy in a straight line, at a limited
// speed (the chord anchor; DESIGN 5.4).
//
// Kept as an offset from the proxy in the device frame D, so zoom and rotation about the proxy carry it along
// unchanged. Once a tick, with the proxy moved by `moved_D` and the hand at h_D:
//
//   offset -= moved_D                                      the anchor stays where it was in the world
//   step = (speed + min(hand_share |v_h|, most_share)) dt  v_h: the hand's velocity, low pass of 5 ms
//   offset = 0 if |offset| <= step, else offset shortened by step
//
// Invariants (each a test), x = p + offset:
//  1. |x_new - x_old| <= step, so a tick changes the spring's force by at most K (step + |dh|), whatever the proxy
//  does.
//  2. |x - h| <= max(|x_old - h|, |p - h|): distance is convex on a chord. The energy in the spring after a jump of the
//     proxy is at most that before it.
//  3. At rest x = p, exactly, after a time |p - x| / speed.
//
// The *vector* velocity is filtered, then its length taken: an encoder's noise averages out instead of adding up.
// Thread rule: thread-compatible; a copy is a snapshot of the whole state. Everything but the constructor is noexcept,
// without allocation.
#pragma once

#include <Eigen/Core>

namespace filiform {

struct AnchorOptions {
  double speed_m_s = 0.10;  // >= 0: of a hand at rest. 0.02 to 0.2 feel alike
  double hand_share = 1.0;  // >= 0: of the hand's own speed, added. 0 drags when the hand moves faster than the anchor
  // >= 0: and no more than this. A hand that slips from a full push moves at up to 1 m/s; an anchor that kept up with
  // it would double the jerk.
  double most_share_m_s = 0.2;
};

class Anchor {
 public:
  // Throws UsageError for an option out of its range or not finite.
  explicit Anchor(const AnchorOptions& options);

  // At the proxy, at rest: after a jump, a change of mode, a start.
  void reset() noexcept;
  // One tick; returns the offset (m, frame D). Arguments that are not finite leave the anchor at the proxy; a dt_s that
  // is not > 0 and finite counts as 0. O(1).
  const Eigen::Vector3d& follow(const Eigen::Vector3d& moved_D, const Eigen::Vector3d& h_D, double dt_s) noexcept;

  const Eigen::Vector3d& offset_D() const noexcept { return offset_D_; }
  double hand_speed_m_s() const noexcept { return v_D_.norm(); }
  const AnchorOptions& options() const noexcept { return options_; }

 private:
  AnchorOptions options_;
  Eigen::Vector3d offset_D_ = Eigen::Vector3d::Zero(), h_D_ = Eigen::Vector3d::Zero(), v_D_ = Eigen::Vector3d::Zero();
  bool knows_hand_ = false;
};

}  // namespace filiform
