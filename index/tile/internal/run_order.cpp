#include "index/tile/internal/run_order.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace filiform::internal {
namespace {

// Splits lists of items, named by their positions. A coordinate and a position together are one number, so that a
// selection compares numbers and moves 8 bytes.
class Splitter {
 public:
  explicit Splitter(std::span<const GridPoint> centres) : keys_(centres.size()) {
    GridBox box;
    for (const GridPoint& centre : centres) box.extend(centre);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      offsets_[axis].reserve(centres.size());
      for (const GridPoint& centre : centres)
        offsets_[axis].push_back(static_cast<std::uint64_t>(centre[i] - box.lo[i]));
    }
    fits_ = box.empty() || (box.hi - box.lo).maxCoeff() <= std::int64_t{UINT32_MAX};
  }

  // `group`: a power of kTreeWidth. A part of at most this size is not split at this level.
  void split(std::span<std::uint32_t> items, std::size_t group) {
    while (group > kTreeWidth && items.size() <= group / kTreeWidth) group /= kTreeWidth;
    if (items.size() <= kTreeWidth) {
      std::sort(items.begin(), items.end());
      return;
    }
    const std::size_t part = group / kTreeWidth, parts = (items.size() + part - 1) / part;
    const std::size_t middle = parts / 2 * part;
    select(items, middle, offsets_[longestSide(items)]);
    split(items.first(middle), group);
    split(items.subspan(middle), group);
  }

 private:
  // The first of the longest.
  std::size_t longestSide(std::span<const std::uint32_t> items) const {
    std::array<std::uint64_t, 3> sides{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::uint64_t lo = UINT64_MAX, hi = 0;
      for (const std::uint32_t item : items) {
        lo = std::min(lo, offsets_[axis][item]);
        hi = std::max(hi, offsets_[axis][item]);
      }
      sides[axis] = hi - lo;
    }
    return static_cast<std::size_t>(std::max_element(sides.begin(), sides.end()) - sides.begin());
  }

  // Moves the `middle` items of the lowest offsets, ties by position, to the front.
  void select(std::span<std::uint32_t> items, std::size_t middle, const std::vector<std::uint64_t>& offsets) {
    if (!fits_) {
      std::nth_element(
          items.begin(), items.begin() + static_cast<std::ptrdiff_t>(middle), items.end(),
          [&](std::uint32_t a, std::uint32_t b) { return offsets[a] != offsets[b] ? offsets[a] < offsets[b] : a < b; });
      return;
    }
    const std::span<std::uint64_t> keys = std::span(keys_).first(items.size());
    for (std::size_t i = 0; i < items.size(); ++i) keys[i] = offsets[items[i]] << 32 | items[i];
    std::nth_element(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(middle), keys.end());
    for (std::size_t i = 0; i < items.size(); ++i) items[i] = static_cast<std::uint32_t>(keys[i]);
  }

  std::array<std::vector<std::uint64_t>, 3> offsets_;  // by axis: from the lowest coordinate
  std::vector<std::uint64_t> keys_;
  bool fits_;  // every offset has at most 32 bits
};

}  // namespace

std::vector<std::uint32_t> orderRuns(std::span<const GridPoint> centres) {
  std::vector<std::uint32_t> order(centres.size());
  std::iota(order.begin(), order.end(), 0u);
  std::size_t group = kTreeWidth;
  while (group < order.size()) group *= kTreeWidth;
  Splitter(centres).split(order, group);
  return order;
}

}  // namespace filiform::internal
