#include "index/remote/internal/http_queue.h"

#include <algorithm>

namespace filiform::internal {
namespace {

// Within this time, a request is answered as from near. From there on gaps and requests grow with the time, up to so
// many times.
constexpr double kNearby_s = 0.02, kMostGapGrowth = 8, kMostUrgentGrowth = 2;

std::uint64_t scaledBytes(std::uint64_t bytes, double growth, double most) {
  return static_cast<std::uint64_t>(static_cast<double>(bytes) * std::clamp(growth, 1.0, most));
}

}  // namespace

void HttpQueue::setLatency(double s) {
  most_gap_ = scaledBytes(kMostGap, s / kNearby_s, kMostGapGrowth);
  most_urgent_ = scaledBytes(kMostUrgent, s / kNearby_s, kMostUrgentGrowth);
}

std::vector<HttpJob*> HttpQueue::take(HttpJob::Clock::time_point now, bool background) {
  const auto next = [&](bool of_background) {
    return std::find_if(jobs_.begin(), jobs_.end(),
                        [&](const HttpJob* job) { return job->not_before <= now && job->background == of_background; });
  };
  auto at = next(false);
  if (at == jobs_.end() && background) at = next(true);
  if (at == jobs_.end()) return {};
  HttpJob* const first = *at;
  std::vector<HttpJob*> together{first};
  if (first->kind == HttpJob::Kind::range && !first->alone) {
    for (HttpJob* const job : jobs_)
      if (job != first && job->kind == HttpJob::Kind::range && !job->alone &&
          (job->not_before <= now || job->gathering) && job->background == first->background && job->url == first->url)
        together.push_back(job);
    std::sort(together.begin() + 1, together.end(),
              [](const HttpJob* a, const HttpJob* b) { return a->offset < b->offset; });
    // Grows the range upwards, then downwards, while the gaps are small.
    std::uint64_t begin = first->offset, end = first->end();
    std::vector<HttpJob*> kept{first};
    const auto grow = [&](HttpJob* job) {
      const std::uint64_t low = std::min(begin, job->offset), high = std::max(end, job->end());
      const bool near = job->offset <= end + most_gap_ && begin <= job->end() + most_gap_;
      if (!near ||
          high - low > std::max<std::uint64_t>(first->background ? kMostMerged : most_urgent_, first->bytes.size()))
        return;
      kept.push_back(job);
      begin = low, end = high;
    };
    for (std::size_t i = 1; i < together.size(); ++i)
      if (together[i]->offset >= first->offset) grow(together[i]);
    for (std::size_t i = together.size(); i-- > 1;)
      if (together[i]->offset < first->offset) grow(together[i]);
    together = std::move(kept);
  }
  std::erase_if(jobs_,
                [&](HttpJob* job) { return std::find(together.begin(), together.end(), job) != together.end(); });
  return together;
}

std::optional<HttpJob::Clock::time_point> HttpQueue::nextReady(bool background) const {
  std::optional<HttpJob::Clock::time_point> next;
  for (const HttpJob* job : jobs_)
    if ((background || !job->background) && (!next || job->not_before < *next)) next = job->not_before;
  return next;
}

std::vector<HttpJob*> HttpQueue::takeAll() {
  std::vector<HttpJob*> all(jobs_.begin(), jobs_.end());
  jobs_.clear();
  return all;
}

}  // namespace filiform::internal
