#include "index/cell/id_runs.h"

#include <algorithm>

namespace filiform {
namespace {

std::int64_t after(std::int64_t id, std::uint32_t steps) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(id) + steps);
}

}  // namespace

IdRuns::IdRuns(std::span<const std::int64_t> ids) {
  for (const std::int64_t id : ids) add(id, 1);
}

void IdRuns::add(std::int64_t first, std::uint32_t count) {
  const bool follows =
      !runs_.empty() && first != INT64_MIN && first == after(runs_.back().first, size_ - runs_.back().rank);
  if (!follows) runs_.push_back({size_, first});
  size_ += count;
}

std::int64_t IdRuns::operator[](std::uint32_t rank) const {
  const auto next =
      std::upper_bound(runs_.begin(), runs_.end(), rank, [](std::uint32_t r, const Run& run) { return r < run.rank; });
  const Run& run = *(next - 1);
  return after(run.first, rank - run.rank);
}

std::vector<std::uint32_t> IdRuns::ranksOf(std::int64_t id) const {
  std::vector<std::uint32_t> ranks;
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const std::uint64_t step = static_cast<std::uint64_t>(id) - static_cast<std::uint64_t>(runs_[i].first);
    if (step < endOf(i) - runs_[i].rank) ranks.push_back(runs_[i].rank + static_cast<std::uint32_t>(step));
  }
  return ranks;
}

std::vector<std::int64_t> IdRuns::all() const {
  std::vector<std::int64_t> ids;
  ids.reserve(size_);
  for (std::size_t i = 0; i < runs_.size(); ++i)
    for (std::uint32_t rank = runs_[i].rank; rank < endOf(i); ++rank)
      ids.push_back(after(runs_[i].first, rank - runs_[i].rank));
  return ids;
}

}  // namespace filiform
