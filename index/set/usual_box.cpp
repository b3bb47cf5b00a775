#include "index/set/usual_box.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace filiform {
namespace {

constexpr double kRim = 0.02;   // part of the segments
constexpr double kWiden = 0.5;  // of the interval
constexpr double kMuchLonger = 2;

struct WeightedEnd {
  std::int64_t at;
  std::uint64_t segments;
};

// The position that this part of the segments does not exceed.
std::int64_t quantile(std::vector<WeightedEnd> ends, double part) {
  std::sort(ends.begin(), ends.end(), [](const WeightedEnd& a, const WeightedEnd& b) { return a.at < b.at; });
  double left = 0;
  for (const WeightedEnd& end : ends) left += part * static_cast<double>(end.segments);
  for (const WeightedEnd& end : ends) {
    left -= static_cast<double>(end.segments);
    if (left <= 0) return end.at;
  }
  return ends.back().at;
}

}  // namespace

UsualBox usualBoxOf(std::span<const TileEntry> entries, TileId long_tile) {
  const auto counts = [&](const TileEntry& entry) {
    return entry.owned > 0 && !entry.content.empty() && (long_tile == kNoTile || &entry != &entries[long_tile]);
  };
  GridBox all;
  bool any = false;
  for (const TileEntry& entry : entries) {
    if (!entry.content.empty()) all.extend(entry.content);
    any |= counts(entry);
  }
  if (!any) return {all, 0};
  GridBox fence = all;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<WeightedEnd> low, high;
    for (const TileEntry& entry : entries) {
      if (!counts(entry)) continue;
      low.push_back({entry.content.lo[axis], entry.owned});
      high.push_back({entry.content.hi[axis], entry.owned});
    }
    const std::int64_t from = quantile(std::move(low), kRim), to = quantile(std::move(high), 1 - kRim);
    const auto wider = static_cast<std::int64_t>(kWiden * static_cast<double>(std::max<std::int64_t>(to - from, 1)));
    fence.lo[axis] = std::max(all.lo[axis], from - wider);
    fence.hi[axis] = std::min(all.hi[axis], to + wider);
  }
  UsualBox usual;
  for (const TileEntry& entry : entries) {
    if (!counts(entry)) continue;
    const GridBox cut{entry.content.lo.cwiseMax(fence.lo), entry.content.hi.cwiseMin(fence.hi)};
    if (cut.empty())
      usual.outside += entry.owned;
    else
      usual.box.extend(cut);
  }
  const auto longer =
      (all.hi - all.lo).cast<double>().array() > kMuchLonger * (usual.box.hi - usual.box.lo).cast<double>().array() + 1;
  if (usual.outside == 0 || !longer.any()) return {all, 0};
  return usual;
}

UsualBox TileStore::usualBox() const {
  std::vector<TileEntry> entries;
  entries.reserve(tile_count());
  for (TileId tile = 0; tile < tile_count(); ++tile) entries.push_back(entry(tile));
  return usualBoxOf(entries, long_tile());
}

}  // namespace filiform
