// FilteredSearches: searches with the filters that were asked for last, for programs in which each query names its own.
//
//   FilteredSearches searches(*set, 64 << 20);
//   searches.with({.types = {2}})->find(p_W);
//
// Thread rule: internally synchronised.
#pragma once

#include "index/query/nearest.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>

namespace filiform {

class FilteredSearches {
 public:
  // `budget_bytes`: of the tiles of all searches together, a third of it for other_cells. The store must outlive the
  // searches.
  FilteredSearches(const TileStore& store, std::uint64_t budget_bytes) : store_(store), budget_bytes_(budget_bytes) {}

  void setBudget(std::uint64_t budget_bytes) {
    const std::lock_guard lock(mutex_);
    budget_bytes_ = budget_bytes;
    for (const Kept& one : kept_) one.search->setBudget(partOf(budget_bytes_));
  }
  // Throws as Nearest. O(cells of the filters).
  std::shared_ptr<const Nearest> with(const SegmentFilter& filter) {
    const std::lock_guard lock(mutex_);
    const auto at = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& one) { return one.filter == filter; });
    if (at != kept_.end()) {
      kept_.splice(kept_.begin(), kept_, at);
    } else {
      const NearestOptions options{.budget_bytes = partOf(budget_bytes_), .filter = filter};
      kept_.push_front({filter, std::make_shared<const Nearest>(store_, options)});
      if (kept_.size() > kMost) kept_.pop_back();
    }
    return kept_.front().search;
  }

 private:
  static constexpr std::size_t kMost = 4;
  static std::uint64_t partOf(std::uint64_t budget_bytes) { return budget_bytes / kMost / 3 * 2; }
  struct Kept {
    SegmentFilter filter;
    std::shared_ptr<const Nearest> search;
  };
  const TileStore& store_;
  std::uint64_t budget_bytes_;  // under the mutex
  std::mutex mutex_;
  std::list<Kept> kept_;  // the last one first
};

}  // namespace filiform
