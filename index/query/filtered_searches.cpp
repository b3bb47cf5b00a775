#include "index/query/filtered_searches.h"

#include <algorithm>

namespace filiform {

std::shared_ptr<const Nearest> FilteredSearches::with(const SegmentFilter& filter) {
  const std::lock_guard lock(mutex_);
  const auto at = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& one) { return one.filter == filter; });
  if (at != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, at);
  } else {
    const NearestOptions options{.budget_bytes = budget_bytes_ / kMost, .filter = filter};
    kept_.push_front({filter, std::make_shared<const Nearest>(store_, options)});
    if (kept_.size() > kMost) kept_.pop_back();
  }
  return kept_.front().search;
}

}  // namespace filiform
