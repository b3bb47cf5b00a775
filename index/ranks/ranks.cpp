#include "index/ranks/ranks.h"

#include <algorithm>
#include <utility>

namespace filiform {

std::vector<Ranks::Bytes> passAll(Ranks& ranks, std::vector<Ranks::Bytes> to) {
  std::vector<Ranks::Bytes> got(ranks.count());
  std::vector<std::size_t> sent(ranks.count(), 0);
  ranks.exchange(
      [&](unsigned r, Ranks::Bytes& piece) {
        const std::size_t n = std::min(to[r].size() - sent[r], ranks.piece_bytes());
        const auto begin = to[r].begin() + static_cast<std::ptrdiff_t>(sent[r]);
        piece.assign(begin, begin + static_cast<std::ptrdiff_t>(n));
        sent[r] += n;
        return n > 0;
      },
      [&](unsigned from, std::span<const std::uint8_t> piece) {
        got[from].insert(got[from].end(), piece.begin(), piece.end());
      });
  got[ranks.rank()] = std::move(to[ranks.rank()]);
  return got;
}

std::vector<Ranks::Bytes> toFirst(Ranks& ranks, Ranks::Bytes mine) {
  std::vector<Ranks::Bytes> to(ranks.count());
  to.front() = std::move(mine);
  return passAll(ranks, std::move(to));
}

}  // namespace filiform
