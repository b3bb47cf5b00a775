#include "index/ingest/tiling/internal/cell_leaves.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kPairsPerGroup = std::uint64_t{1} << 22;
constexpr std::uint64_t kBytesOfPair = 12;  // while a group is sorted
constexpr std::size_t kPairBlock = std::size_t{4} << 10;

}  // namespace

CellLeaves::CellLeaves(const std::vector<CellRecord>& records, unsigned workers, std::string folder,
                       std::uint64_t spool_memory, std::uint64_t sort_memory)
    : workers_(workers),
      cells_(static_cast<std::uint32_t>(records.size())),
      spool_(std::move(folder), kPairBlock, spool_memory) {
  const std::uint64_t per_group =
      std::max<std::uint64_t>(1, std::min<std::uint64_t>(kPairsPerGroup, sort_memory / kBytesOfPair));
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

// Counts the pairs of each cell, and then puts each where it belongs.
void CellLeaves::readGroup(std::size_t group) {
  const std::size_t groups = group_begin_.size();
  std::size_t size = 0;
  for (unsigned worker = 0; worker < workers_; ++worker)
    size += chains_[worker * groups + group].bytes() / sizeof(Pair);
  pairs_.resize(size);
  std::size_t read = 0;
  for (unsigned worker = 0; worker < workers_; ++worker) {
    ByteChain& chain = chains_[worker * groups + group];
    const std::size_t n = chain.bytes() / sizeof(Pair);
    ByteChain::Reader(chain, true).read(reinterpret_cast<std::uint8_t*>(pairs_.data() + read), n * sizeof(Pair));
    read += n;
  }
  first_cell_ = group_begin_[group];
  const std::uint32_t end = group + 1 < groups ? group_begin_[group + 1] : cells_;
  end_.assign(end - first_cell_ + std::size_t{1}, 0);
  for (const Pair& pair : pairs_) ++end_[pair.cell - first_cell_ + 1];
  std::partial_sum(end_.begin(), end_.end(), end_.begin());
  leaves_.resize(size);
  for (const Pair& pair : pairs_) leaves_[end_[pair.cell - first_cell_]++] = pair.leaf;
}

std::span<const std::uint32_t> CellLeaves::next(std::uint32_t cell) {
  if (startsGroup(cell)) readGroup(next_group_++);
  const std::size_t at = cell - first_cell_, begin = at == 0 ? 0 : end_[at - 1];
  const std::span<std::uint32_t> leaves = std::span(leaves_).subspan(begin, end_[at] - begin);
  if (!std::is_sorted(leaves.begin(), leaves.end())) std::sort(leaves.begin(), leaves.end());
  return leaves;
}

}  // namespace filiform::internal
