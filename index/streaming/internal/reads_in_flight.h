// ReadsInFlight: how many tiles to read at once, from the measured time of reads. More reads at once hide the latency
// of a distant source. They gain nothing once they only wait for each other: the time of a read then grows with their
// number, as in TCP Vegas. Thread rule: thread-compatible.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace filiform::internal {

class ReadsInFlight {
 public:
  // Between `least` and `most` reads; begins with `most`, because the first jump comes before any measurement.
  ReadsInFlight(unsigned least, unsigned most) : least_(least), most_(std::max(least, most)), now_(most_) {}

  // Adds the time of one read, s.
  void add(double s) {
    if (!(s >= 0 && std::isfinite(s))) return;
    sum_s_ += s;
    if (s >= kNear_s) shortest_s_ = std::min(shortest_s_, s);  // a hit of a cache says nothing of the source
    if (++count_ < kWindow) return;
    const double mean_s = sum_s_ / kWindow;
    // The base forgets slowly, so that it follows a path that has become longer.
    base_s_ = std::min(1.05 * base_s_, shortest_s_);
    if (mean_s < kNear_s || mean_s > kCrowded * base_s_) {
      now_ = std::max(least_, now_ - std::max(now_ / 4, 1U));
    } else if (mean_s < kFree * base_s_) {
      now_ = std::min(most_, now_ + kUp);
    }
    sum_s_ = 0, shortest_s_ = std::numeric_limits<double>::infinity(), count_ = 0;
  }
  unsigned most() const { return now_; }
  double fastest_s() const { return std::isfinite(base_s_) ? base_s_ : 0; }  // 0: not known, or near

 private:
  static constexpr unsigned kWindow = 16, kUp = 4;
  static constexpr double kNear_s = 0.004;             // a source as near as this needs no more reads
  static constexpr double kFree = 1.25, kCrowded = 2;  // mean time of a read over that of the fastest
  const unsigned least_, most_;
  unsigned now_, count_ = 0;
  double sum_s_ = 0, shortest_s_ = std::numeric_limits<double>::infinity();
  double base_s_ = std::numeric_limits<double>::infinity();  // of the fastest reads
};

}  // namespace filiform::internal
