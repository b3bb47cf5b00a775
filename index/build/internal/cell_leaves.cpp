#include "index/build/internal/cell_leaves.h"

#include <algorithm>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kPairsPerGroup = std::uint64_t{1} << 22;
constexpr std::size_t kPairBlock = std::size_t{4} << 10;

}  // namespace

CellLeaves::CellLeaves(const std::vector<CellRecord>& records, unsigned workers, std::string folder,
                       std::uint64_t spool_memory, std::uint64_t sort_memory)
    : workers_(workers), spool_(std::move(folder), kPairBlock, spool_memory) {
  const std::uint64_t per_group =
      std::max<std::uint64_t>(1, std::min<std::uint64_t>(kPairsPerGroup, sort_memory / sizeof(Pair)));
  std::uint64_t in_group = per_group;
  for (std::uint32_t cell = 0; cell < records.size(); ++cell) {
    if (in_group >= per_group) {
      group_begin_.push_back(cell);
      in_group = 0;
    }
    in_group += records[cell].segments + records[cell].isolated;
  }
  if (group_begin_.empty()) group_begin_.push_back(0);
  for (std::size_t i = 0; i < group_begin_.size() * workers; ++i) chains_.emplace_back(spool_);
}

std::size_t CellLeaves::groupOf(std::uint32_t cell) const {
  return static_cast<std::size_t>(std::upper_bound(group_begin_.begin(), group_begin_.end(), cell) -
                                  group_begin_.begin() - 1);
}

void CellLeaves::close() {
  for (ByteChain& chain : chains_) chain.close();
}

void CellLeaves::readGroup(std::size_t group) {
  const std::size_t groups = group_begin_.size();
  pairs_.clear();
  at_ = 0;
  std::size_t size = 0;
  for (unsigned worker = 0; worker < workers_; ++worker)
    size += chains_[worker * groups + group].bytes() / sizeof(Pair);
  pairs_.reserve(size);
  for (unsigned worker = 0; worker < workers_; ++worker) {
    ByteChain& chain = chains_[worker * groups + group];
    const std::size_t n = chain.bytes() / sizeof(Pair);
    pairs_.resize(pairs_.size() + n);
    ByteChain::Reader(chain, true)
        .read(reinterpret_cast<std::uint8_t*>(pairs_.data() + pairs_.size() - n), n * sizeof(Pair));
  }
  std::sort(pairs_.begin(), pairs_.end(),
            [](const Pair& a, const Pair& b) { return a.cell != b.cell ? a.cell < b.cell : a.leaf < b.leaf; });
}

std::span<const CellLeaves::Pair> CellLeaves::next(std::uint32_t cell) {
  if (startsGroup(cell)) readGroup(next_group_++);
  const std::size_t begin = at_;
  while (at_ < pairs_.size() && pairs_[at_].cell == cell) ++at_;
  return std::span(pairs_).subspan(begin, at_ - begin);
}

}  // namespace filiform::internal
