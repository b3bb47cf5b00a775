// Timing figures of the haptic loop: histograms with fixed buckets, missed deadlines, and the last ticks in full.
//
// Recording neither allocates nor locks. Thread rule: the haptic thread writes; read after the loop has stopped.
#pragma once

#include <array>
#include <cstdint>
#include <iosfwd>
#include <vector>

namespace filiform {

// Log-linear buckets: exact below 32 ns; above, 32 buckets for each octave, so a bucket is at most 1/32 wide. Times
// over 2^40 ns (18 minutes) go into the last bucket. Takes 9.5 KiB, however much is recorded.
class TimeHistogram {
 public:
  void record(std::int64_t time_ns) noexcept;  // a negative time counts as 0; O(1)
  void add(const TimeHistogram& other);        // adds the records of `other`

  std::uint64_t count() const { return count_; }
  std::int64_t max_ns() const { return max_ns_; }  // exact; 0 when empty
  double mean_ns() const { return count_ ? sum_ns_ / static_cast<double>(count_) : 0.0; }
  // The smallest time that is not exceeded by `fraction` (0..1) of the records, rounded up to its bucket's upper end
  // but at most max_ns(); 0 when empty. O(buckets).
  std::int64_t percentile_ns(double fraction) const;

 private:
  static constexpr int kSubBits = 5, kMaxBits = 40;
  static constexpr std::size_t kBuckets = std::size_t{kMaxBits - kSubBits + 1} << kSubBits;
  static std::size_t bucketOf(std::uint64_t time_ns) noexcept;
  static std::uint64_t lastOf(std::size_t bucket);

  std::array<std::uint64_t, kBuckets> counts_{};
  std::uint64_t count_ = 0;
  std::int64_t max_ns_ = 0;
  double sum_ns_ = 0;
};

struct LoopTick {                // ns
  std::int64_t start_ns = 0;     // since the loop began
  std::int64_t wake_ns = 0;      // delay of the start after its scheduled time; 0 if the device paces the loop
  std::int64_t exchange_ns = 0;  // in HapticDevice::exchange
  std::int64_t compute_ns = 0;   // everything else in the tick
  std::int64_t period_ns = 0;    // since the start of the tick before; 0 at the first
  bool missed = false;           // the tick ended after the scheduled start of the next one
  bool interrupted = false;      // the computed force was too old: zero was sent instead
  double force_N = 0;            // magnitude of the force that was sent
};

class LoopMetrics {
 public:
  // Keeps the last `ring_ticks` ticks in full (0: none). Only the constructor allocates.
  explicit LoopMetrics(std::size_t ring_ticks = 4096) : ring_(ring_ticks) {}

  void record(const LoopTick& tick) noexcept;

  const TimeHistogram& wake() const { return wake_; }
  const TimeHistogram& compute() const { return compute_; }
  const TimeHistogram& exchange() const { return exchange_; }
  const TimeHistogram& period() const { return period_; }
  std::uint64_t ticks() const { return ticks_; }
  std::uint64_t missed_deadlines() const { return missed_; }

  // Oldest first.
  std::vector<LoopTick> lastTicks() const;
  // Writes a header and one row for each tick, oldest first:
  // tick,start_ns,wake_ns,exchange_ns,compute_ns,period_ns,missed,interrupted,force_N
  void writeCsv(std::ostream& out) const;

 private:
  TimeHistogram wake_, compute_, exchange_, period_;
  std::vector<LoopTick> ring_;
  std::uint64_t ticks_ = 0, missed_ = 0;
};

}  // namespace filiform
