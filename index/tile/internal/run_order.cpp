#include "index/tile/internal/run_order.h"

#include <algorithm>

namespace filiform::internal {
namespace {

struct Item {
  GridPoint centre;
  std::uint32_t rank;
};

// `group`: a power of kTreeWidth. A part of at most this size is not split at this level.
void split(std::span<Item> items, std::size_t group) {
  while (group > kTreeWidth && items.size() <= group / kTreeWidth) group /= kTreeWidth;
  if (items.size() <= kTreeWidth) {
    std::sort(items.begin(), items.end(), [](const Item& a, const Item& b) { return a.rank < b.rank; });
    return;
  }
  GridBox box;
  for (const Item& item : items) box.extend(item.centre);
  int axis = 0;
  (box.hi - box.lo).maxCoeff(&axis);
  const std::size_t part = group / kTreeWidth, parts = (items.size() + part - 1) / part;
  const std::size_t middle = parts / 2 * part;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(middle), items.end(),
                   [axis](const Item& a, const Item& b) {
                     return a.centre[axis] != b.centre[axis] ? a.centre[axis] < b.centre[axis] : a.rank < b.rank;
                   });
  split(items.first(middle), group);
  split(items.subspan(middle), group);
}

}  // namespace

std::vector<std::uint32_t> orderRuns(std::span<const GridPoint> centres) {
  std::vector<Item> items;
  items.reserve(centres.size());
  for (const GridPoint& centre : centres) items.push_back({centre, static_cast<std::uint32_t>(items.size())});
  std::size_t group = kTreeWidth;
  while (group < items.size()) group *= kTreeWidth;
  split(items, group);
  std::vector<std::uint32_t> order;
  order.reserve(items.size());
  for (const Item& item : items) order.push_back(item.rank);
  return order;
}

}  // namespace filiform::internal
