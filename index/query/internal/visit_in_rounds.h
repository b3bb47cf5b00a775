// Visits the results of a search, in order, that can only be asked for so many at most. Thread rule: one thread.
#pragma once

#include <cstddef>
#include <vector>

namespace filiform::internal {

// find(most) puts the first so many results into `results`, and returns what it cost. visit(result) returns false to
// end.
template <class Result, class Find, class Visit>
auto visitInRounds(std::vector<Result>& results, const Find& find, const Visit& visit) {
  constexpr std::size_t kFirst = 8, kGrowth = 4;
  decltype(find(kFirst)) counts{};
  for (std::size_t most = kFirst, seen = 0;; most *= kGrowth) {
    counts += find(most);
    for (; seen < results.size(); ++seen)
      if (!visit(results[seen])) return counts;
    if (results.size() < most) return counts;
  }
}

}  // namespace filiform::internal
