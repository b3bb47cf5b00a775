// Names like one that is not there: what messages offer to a person who misspelt a command, an option or a cell.
// Thread rule: thread-compatible.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

// Keeps the names nearest to `wanted`, best first: equal but for letter case, then names that begin with it, then names
// that hold it, then names a few edits away (an edit inserts, removes, replaces or swaps letters; at most one for three
// letters of `wanted`, and one at least). Equally near names are in byte order. ASCII letters count without case.
class NearNames {
 public:
  explicit NearNames(std::string_view wanted, std::size_t most = 3);
  // O(length of both).
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

// "; did you mean 'a', 'b' or 'c'?", escaped; empty without names.
std::string didYouMean(const std::vector<std::string>& names);

}  // namespace filiform::tools
