#include "index/file/faulty_source.h"

#include "index/errors.h"
#include "index/file/internal/digest.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

namespace filiform {
namespace {

// Steele, Lea, Flood 2014: every input bit affects every output bit.
std::uint64_t splitMix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return x ^ (x >> 31);
}

double unit(std::uint64_t bits) { return std::ldexp(static_cast<double>(bits >> 11), -53); }  // [0, 1)

double delayOf(const FaultPlan& plan, double u) {
  switch (plan.delay) {
    case FaultPlan::Delay::none:
      return 0;
    case FaultPlan::Delay::constant:
      return plan.delay_s;
    case FaultPlan::Delay::uniform:
      return 2 * u * plan.delay_s;
    case FaultPlan::Delay::exponential:
      return std::min(plan.most_s, -plan.delay_s * std::log1p(-u));
  }
  return 0;
}

}  // namespace

FaultySource::FaultySource(std::unique_ptr<TileSource> source, FaultPlan plan)
    : source_(std::move(source)), plan_(std::move(plan)) {
  const auto sane = [](double s) { return s >= 0 && std::isfinite(s); };
  if (!sane(plan_.delay_s) || !sane(plan_.most_s)) throw UsageError("an injected delay must be finite and >= 0 s");
  if (!(plan_.fail_probability >= 0 && plan_.fail_probability <= 1))
    throw UsageError("the probability of an injected failure must lie between 0 and 1");
  if (!plan_.wait) plan_.wait = [](double s) { std::this_thread::sleep_for(std::chrono::duration<double>(s)); };
}

void FaultySource::arm() { armed_.store(true, std::memory_order_relaxed); }
void FaultySource::disarm() { armed_.store(false, std::memory_order_relaxed); }

void FaultySource::failRange(const std::string& name, std::uint64_t begin, std::uint64_t end) {
  const std::lock_guard lock(mutex_);
  ranges_.push_back({name, begin, end});
}

void FaultySource::heal() {
  const std::lock_guard lock(mutex_);
  ranges_.clear();
  healed_ = true;
}

void FaultySource::read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const {
  const bool armed = armed_.load(std::memory_order_relaxed);
  bool fails = false;
  double delay_s = 0;
  {
    const std::lock_guard lock(mutex_);
    fails = std::any_of(ranges_.begin(), ranges_.end(), [&](const Range& r) {
      return r.name == name && offset < r.end && offset + bytes.size() > r.begin;
    });
    if (armed) {
      const std::uint64_t number = reads_.fetch_add(1, std::memory_order_relaxed) + 1, time = times_[{name, offset}]++;
      const std::uint64_t place = internal::checksum(name) ^ splitMix(offset);
      const std::uint64_t draw = splitMix(plan_.seed ^ splitMix(place ^ splitMix(time)));
      delay_s = delayOf(plan_, unit(draw));
      if (!healed_)
        fails |=
            (plan_.fail_every > 0 && number % plan_.fail_every == 0) || unit(splitMix(draw)) < plan_.fail_probability;
    }
  }
  if (delay_s > 0) plan_.wait(delay_s);
  if (fails) {
    failures_.fetch_add(1, std::memory_order_relaxed);
    throw IoError(describe(name), "an injected fault at byte " + std::to_string(offset));
  }
  source_->read(name, offset, bytes);
}

}  // namespace filiform
