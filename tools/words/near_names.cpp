#include "tools/words/near_names.h"

#include "index/text.h"

#include <algorithm>
#include <numeric>

namespace filiform::tools {

namespace {

// The number of insertions, removals, replacements and swaps of neighbours that turn one text into the other; `most` +
// 1 if it is more than `most`.
std::size_t editsBetween(const std::string& a, const std::string& b, std::size_t most) {
  if (std::max(a.size(), b.size()) - std::min(a.size(), b.size()) > most) return most + 1;
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), now(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    now[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) now[j] = std::min(now[j], before[j - 2] + 1);
    }
    if (*std::min_element(now.begin(), now.end()) > most) return most + 1;
    before.swap(last);
    last.swap(now);
  }
  return std::min(last[b.size()], most + 1);
}

}  // namespace

NearNames::NearNames(std::string_view wanted, std::size_t most) : wanted_(lowerCase(wanted)), most_(most) {}

void NearNames::offer(const std::string& name) {
  const std::string lower = lowerCase(name);
  const std::size_t letters = wanted_.size() - std::min(wanted_.find_first_not_of('-'), wanted_.size());
  // The cost of edits is the product of the lengths.
  constexpr std::size_t kLongest = 200;
  const std::size_t allowed = wanted_.size() > kLongest ? 0 : std::max<std::size_t>(1, letters / 3);
  Rank rank{0, 0};
  if (lower != wanted_) {
    const std::size_t at = wanted_.size() > 1 ? lower.find(wanted_) : std::string::npos;
    rank = {at == 0 ? 1 : at != std::string::npos ? 2 : 3, allowed > 0 ? editsBetween(wanted_, lower, allowed) : 1};
    if (rank.kind == 3 && (rank.edits > allowed || (letters == 1 && lower.size() == wanted_.size()))) return;
  }
  std::size_t place = ranks_.size();
  while (place > 0 && (rank < ranks_[place - 1] || (rank == ranks_[place - 1] && name < names_[place - 1]))) --place;
  if (place >= most_) return;
  ranks_.insert(ranks_.begin() + static_cast<std::ptrdiff_t>(place), rank);
  names_.insert(names_.begin() + static_cast<std::ptrdiff_t>(place), name);
  if (names_.size() > most_) {
    ranks_.pop_back();
    names_.pop_back();
  }
}

std::string didYouMean(const std::vector<std::string>& names) {
  if (names.empty()) return {};
  std::string text = "; did you mean ";
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 < names.size() ? ", " : " or ";
    ((text += '\'') += escaped(names[i], 80)) += '\'';
  }
  return text += '?';
}

}  // namespace filiform::tools
