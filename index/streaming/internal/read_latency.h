// ReadLatency: how long reads of tiles take, measured as TCP measures its round trip (RFC 6298). Thread rule:
// thread-compatible.
#pragma once

#include <algorithm>
#include <cmath>

namespace filiform::internal {

class ReadLatency {
 public:
  // Adds the time of one read, s.
  void add(double s) {
    if (!(s >= 0 && std::isfinite(s))) return;
    if (mean_s_ < 0) {
      mean_s_ = s;
      spread_s_ = s / 2;
      return;
    }
    spread_s_ += (std::abs(s - mean_s_) - spread_s_) / 4;
    mean_s_ += (s - mean_s_) / 8;
  }
  double mean_s() const { return std::max(0.0, mean_s_); }
  // How far to look ahead, s: the time of kReads slow reads, from kLeast_s to `usual`; `usual` if nothing was measured.
  // If two slow reads take longer, their time, at most kMost_s: the second is of a tile that the walk reaches only
  // through the first.
  double lookahead_s(double usual) const {
    if (mean_s_ < 0) return usual;
    const double slow_s = mean_s_ + 4 * spread_s_;
    return std::max(std::clamp(kReads * slow_s, std::min(kLeast_s, usual), usual), std::min(kMost_s, 2 * slow_s));
  }

 private:
  static constexpr double kReads = 60, kLeast_s = 0.15, kMost_s = 4;
  double mean_s_ = -1, spread_s_ = 0;
};

}  // namespace filiform::internal
