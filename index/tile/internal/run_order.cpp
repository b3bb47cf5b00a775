#include "index/tile/internal/run_order.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace filiform::internal {
namespace {

using Ends = Eigen::Array<std::int32_t, 4, 1>;  // of three coordinates

// Splits lists of items, named by their positions. A coordinate and a position together are one number, so that a
// selection compares numbers and moves 8 bytes. `Offsets`: coordinates from the lowest ones.
template <typename Offsets>
class Splitter {
 public:
  Splitter(std::span<const GridPoint> centres, const GridPoint& lowest)
      : offsets_(centres, lowest), keys_(centres.size()), begin_of_(centres.size()), items_(centres.size()) {
    std::iota(items_.begin(), items_.end(), 0u);
  }

  // `group`: a power of kTreeWidth.
  std::vector<std::uint32_t> order(std::size_t group) {
    split(0, items_.size(), group);
    std::vector<std::uint32_t> order(items_.size()), next(items_.size());
    std::iota(next.begin(), next.end(), 0u);
    for (std::uint32_t item = 0; item < order.size(); ++item) order[next[begin_of_[item]]++] = item;
    return order;
  }

 private:
  // A part of at most `group` items is not split at this level.
  void split(std::size_t begin, std::size_t end, std::size_t group) {
    const std::span<std::uint32_t> items = std::span(items_).subspan(begin, end - begin);
    while (group > kTreeWidth && items.size() <= group / kTreeWidth) group /= kTreeWidth;
    if (items.size() <= kTreeWidth) {
      for (const std::uint32_t item : items) begin_of_[item] = static_cast<std::uint32_t>(begin);
      return;
    }
    const std::size_t part = group / kTreeWidth, parts = (items.size() + part - 1) / part;
    const std::size_t middle = parts / 2 * part;
    offsets_.select(items, middle, keys_);
    split(begin, begin + middle, group);
    split(begin + middle, end, group);
  }

  Offsets offsets_;
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> begin_of_, items_;  // of the group of an item; the current order
};

// Moves the `count` lowest keys, all different, to the front. Without branches on keys, which a processor cannot
// predict.
void selectLowest(std::span<std::uint64_t> keys, std::size_t count) {
  constexpr std::size_t kFew = 8;
  int rounds = 2 * std::bit_width(keys.size());
  while (keys.size() > kFew && --rounds > 0) {
    const std::size_t n = keys.size();
    const std::uint64_t a = keys[n / 4], b = keys[n / 2], c = keys[n / 4 * 3];
    const std::uint64_t pivot = std::max(std::min(a, b), std::min(std::max(a, b), c));
    std::size_t below = 0;
    for (std::uint64_t& key : keys) {
      const std::uint64_t value = key;
      key = keys[below];
      keys[below] = value;
      below += value < pivot;
    }
    if (below == count) return;
    if (below > count) {
      keys = keys.first(below);
    } else {
      keys = keys.subspan(below);
      count -= below;
    }
  }
  std::nth_element(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(count), keys.end());
}

// Coordinates of less than 2^31, so that four are compared at once.
class NearOffsets {
 public:
  NearOffsets(std::span<const GridPoint> centres, const GridPoint& lowest) {
    ends_.reserve(centres.size());
    for (const GridPoint& centre : centres) {
      const GridPoint p = centre - lowest;
      ends_.emplace_back(static_cast<std::int32_t>(p[0]), static_cast<std::int32_t>(p[1]),
                         static_cast<std::int32_t>(p[2]), 0);
    }
  }
  // Moves the `middle` items of the lowest offsets along the longest side, ties by position, to the front.
  void select(std::span<std::uint32_t> items, std::size_t middle, std::vector<std::uint64_t>& keys) const {
    Ends lo = ends_[items[0]], hi = lo;
    for (const std::uint32_t item : items) {
      lo = lo.min(ends_[item]);
      hi = hi.max(ends_[item]);
    }
    const Ends sides = hi - lo;
    const Eigen::Index axis = sides[0] >= sides[1] && sides[0] >= sides[2] ? 0 : sides[1] >= sides[2] ? 1 : 2;
    for (std::size_t i = 0; i < items.size(); ++i)
      keys[i] = static_cast<std::uint64_t>(ends_[items[i]][axis]) << 32 | items[i];
    selectLowest(std::span(keys).first(items.size()), middle);
    for (std::size_t i = 0; i < items.size(); ++i) items[i] = static_cast<std::uint32_t>(keys[i]);
  }

 private:
  std::vector<Ends> ends_;
};

// Any coordinates.
class FarOffsets {
 public:
  FarOffsets(std::span<const GridPoint> centres, const GridPoint&) : centres_(centres) {}

  void select(std::span<std::uint32_t> items, std::size_t middle, std::vector<std::uint64_t>&) const {
    GridBox box;
    for (const std::uint32_t item : items) box.extend(centres_[item]);
    Eigen::Index axis = 0;
    (box.hi - box.lo).maxCoeff(&axis);  // the first of the longest
    std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(middle), items.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                       const std::int64_t x = centres_[a][axis], y = centres_[b][axis];
                       return x != y ? x < y : a < b;
                     });
  }

 private:
  std::span<const GridPoint> centres_;
};

}  // namespace

std::vector<std::uint32_t> orderRuns(std::span<const GridPoint> centres) {
  std::size_t group = kTreeWidth;
  while (group < centres.size()) group *= kTreeWidth;
  GridBox box;
  for (const GridPoint& centre : centres) box.extend(centre);
  if (box.empty() || (box.hi - box.lo).maxCoeff() <= INT32_MAX)
    return Splitter<NearOffsets>(centres, box.lo).order(group);
  return Splitter<FarOffsets>(centres, box.lo).order(group);
}

}  // namespace filiform::internal
