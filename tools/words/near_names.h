// Suggestions for a misspelt command, option, cell or value. Thread rule: thread-compatible.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

// Keeps the names nearest to `wanted`, best first:
//   1. equal except for letter case
//   2. names that begin with `wanted`
//   3. names that contain `wanted`
//   4. names a few edits away: an edit inserts, removes, replaces or swaps letters. At most one edit for every three
//      letters of `wanted` (dashes before it are none), and at least one; a single letter is not
//      replaced, and `wanted` has at most 200 letters
// Equally near names are in byte order. The case of ASCII letters does not count.
class NearNames {
 public:
  explicit NearNames(std::string_view wanted, std::size_t most = 3);
  // O(product of the lengths).
  void offer(const std::string& name);
  const std::vector<std::string>& names() const { return names_; }

 private:
  struct Rank {
    int kind;
    std::size_t edits;
    auto operator<=>(const Rank&) const = default;
  };
  std::string wanted_;
  std::size_t most_;
  std::vector<Rank> ranks_;
  std::vector<std::string> names_;
};

// "; did you mean 'a', 'b' or 'c'?", escaped. Empty if there are no names.
std::string didYouMean(const std::vector<std::string>& names);

}  // namespace filiform::tools
