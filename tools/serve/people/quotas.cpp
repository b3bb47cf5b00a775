#include "tools/serve/people/quotas.h"

#include <algorithm>
#include <cmath>

namespace filiform::tools {

namespace {

constexpr std::chrono::minutes kMinute{1};
constexpr double kMinute_s = 60;

}  // namespace

Quotas::Used& Quotas::used(const std::string& name, Clock::time_point now) {
  if (used_.size() > kMostNames)
    std::erase_if(used_, [now](const auto& one) { return now - one.second.since > kMinute; });
  if (used_.size() > 2 * kMostNames) used_.clear();
  return used_[name];
}

unsigned Quotas::take(const std::string& name, unsigned per_minute, Clock::time_point now) {
  if (per_minute == 0) return 0;
  const std::lock_guard lock(mutex_);
  Used& own = used(name, now);
  const double passed_s =
      own.since == Clock::time_point{} ? kMinute_s : std::chrono::duration<double>(now - own.since).count();
  own.since = now;
  own.left = std::min<double>(per_minute, own.left + passed_s * per_minute / kMinute_s);
  if (own.left >= 1) {
    own.left -= 1;
    return 0;
  }
  return static_cast<unsigned>(std::ceil((1 - own.left) * kMinute_s / per_minute));
}

unsigned Quotas::count(const std::string& name, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  Used& own = used(name, now);
  if (own.counted == 0 || now - own.since > kMinute) {
    own.since = now;
    own.counted = 0;
  }
  return ++own.counted;
}

}  // namespace filiform::tools
