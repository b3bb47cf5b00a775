// Visits the results of a search, in order, that can only be asked for so many at most. Thread rule: one thread.
#pragma once

#include <cstddef>
#include <vector>

namespace filiform::internal {

// find(results) fills the list with the first `most` results, and returns what it cost; visit(result) returns false to
// end. Sets `most`, a part of what find() asks for.
template <class Result, class Find, class Visit>
auto visitInRounds(std::size_t& most, const Find& find, const Visit& visit) {
  constexpr std::size_t kFirst = 8, kGrowth = 4;
  std::vector<Result> results;
  decltype(find(results)) counts{};
  std::size_t seen = 0;
  for (most = kFirst;; most *= kGrowth) {
    counts += find(results);
    for (; seen < results.size(); ++seen)
      if (!visit(results[seen])) return counts;
    if (results.size() < most) return counts;
  }
}

}  // namespace filiform::internal
