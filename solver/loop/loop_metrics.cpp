#include "solver/loop/loop_metrics.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <ostream>

namespace filiform {

std::size_t TimeHistogram::bucketOf(std::uint64_t time_ns) noexcept {
  const int bits = std::bit_width(time_ns);
  if (bits <= kSubBits) return time_ns;
  if (bits > kMaxBits) return kBuckets - 1;
  const int shift = bits - kSubBits - 1;
  return (static_cast<std::size_t>(shift) << kSubBits) + (time_ns >> shift);
}

std::uint64_t TimeHistogram::lastOf(std::size_t bucket) {
  if (bucket < (2u << kSubBits)) return bucket;
  const std::size_t shift = (bucket >> kSubBits) - 1;
  return ((bucket - (shift << kSubBits) + 1) << shift) - 1;
}

void TimeHistogram::record(std::int64_t time_ns) noexcept {
  const std::int64_t time = std::max<std::int64_t>(time_ns, 0);
  ++counts_[bucketOf(static_cast<std::uint64_t>(time))];
  ++count_;
  sum_ns_ += static_cast<double>(time);
  max_ns_ = std::max(max_ns_, time);
}

void TimeHistogram::add(const TimeHistogram& other) {
  for (std::size_t bucket = 0; bucket < kBuckets; ++bucket) counts_[bucket] += other.counts_[bucket];
  count_ += other.count_;
  sum_ns_ += other.sum_ns_;
  max_ns_ = std::max(max_ns_, other.max_ns_);
}

std::int64_t TimeHistogram::percentile_ns(double fraction) const {
  if (count_ == 0) return 0;
  const double wanted = std::ceil(std::clamp(fraction, 0.0, 1.0) * static_cast<double>(count_));
  std::uint64_t seen = 0;
  for (std::size_t bucket = 0; bucket + 1 < kBuckets; ++bucket) {
    seen += counts_[bucket];
    if (seen > 0 && static_cast<double>(seen) >= wanted)
      return std::min(max_ns_, static_cast<std::int64_t>(lastOf(bucket)));
  }
  return max_ns_;
}

void LoopMetrics::record(const LoopTick& tick) noexcept {
  if (!ring_.empty()) ring_[ticks_ % ring_.size()] = tick;
  wake_.record(tick.wake_ns);
  compute_.record(tick.compute_ns);
  exchange_.record(tick.exchange_ns);
  if (ticks_ > 0) period_.record(tick.period_ns);
  ++ticks_;
  missed_ += tick.missed;
}

std::vector<LoopTick> LoopMetrics::lastTicks() const {
  const std::uint64_t kept = std::min<std::uint64_t>(ticks_, ring_.size());
  std::vector<LoopTick> ticks;
  ticks.reserve(kept);
  for (std::uint64_t tick = ticks_ - kept; tick < ticks_; ++tick) ticks.push_back(ring_[tick % ring_.size()]);
  return ticks;
}

void LoopMetrics::writeCsv(std::ostream& out) const {
  out << "tick,start_ns,wake_ns,exchange_ns,compute_ns,period_ns,missed,interrupted,force_N\n";
  const std::vector<LoopTick> ticks = lastTicks();
  std::uint64_t number = ticks_ - ticks.size();
  for (const LoopTick& tick : ticks) {
    out << number++;
    for (std::int64_t time_ns : {tick.start_ns, tick.wake_ns, tick.exchange_ns, tick.compute_ns, tick.period_ns})
      out << ',' << time_ns;
    out << ',' << (tick.missed ? 1 : 0) << ',' << (tick.interrupted ? 1 : 0) << ',' << tick.force_N << '\n';
  }
}

}  // namespace filiform
