#include "index/contacts/internal/site_merger.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <utility>

namespace filiform::internal {
namespace {

void setNearest(ContactSite& site, const ContactPair& pair) {
  site.distance_um = pair.distance_um;
  for (std::size_t side = 0; side < 2; ++side) {
    ContactSite::Side& s = site.sides[side];
    s.cell = pair.cell[side], s.segment = pair.segment[side];
    s.child = pair.child[side], s.parent = pair.parent[side];
    s.type = pair.type[side], s.t = pair.t[side];
  }
}

}  // namespace

std::uint32_t SiteMerger::root(std::uint32_t pair) {
  while (before_[pair] != pair) pair = before_[pair] = before_[before_[pair]];
  return pair;
}

void SiteMerger::join(std::uint32_t a, std::uint32_t b) {
  a = root(a), b = root(b);
  before_[std::max(a, b)] = std::min(a, b);
}

std::span<const ContactSite> SiteMerger::merge(std::span<const ContactPair> pairs) {
  constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15;
  constexpr std::uint32_t kNone = UINT32_MAX;
  const auto count = static_cast<std::uint32_t>(pairs.size());
  const std::size_t slots = std::bit_ceil(std::size_t{8} * count);  // at most half are used
  const int shift = 64 - std::countr_zero(slots);
  slots_.assign(slots, {0, kNone});
  before_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    before_[i] = i;
    const ContactPair& p = pairs[i];
    for (const std::uint32_t a : {p.child[0], p.parent[0]})
      for (const std::uint32_t b : {p.child[1], p.parent[1]}) {
        const std::uint64_t samples = std::uint64_t{a} << 32 | b;
        std::size_t at = samples * kGolden >> shift;
        while (slots_[at].pair != kNone && slots_[at].samples != samples) at = (at + 1) % slots;
        if (slots_[at].pair == kNone) slots_[at] = {samples, i};
        join(slots_[at].pair, i);
      }
  }
  sites_.clear(), segments_.clear(), last_.clear();
  site_of_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const ContactPair& p = pairs[i];
    const std::uint32_t first = root(i);
    if (first == i) {
      site_of_[i] = static_cast<std::uint32_t>(sites_.size());
      setNearest(sites_.emplace_back(), p);
      last_.push_back(UINT32_MAX);
    }
    const std::uint32_t at = site_of_[i] = site_of_[first];
    ContactSite& site = sites_[at];
    ++site.pairs;
    if (p.distance_um < site.distance_um) setNearest(site, p);
    // Pairs ascend by the segments of the first cell. Lengths are added in the order of segments.
    if (std::exchange(last_[at], p.segment[0]) != p.segment[0]) site.sides[0].length_um += p.length_um[0];
    segments_.push_back({std::uint64_t{at} << 32 | p.segment[1], p.length_um[1]});
  }
  std::sort(segments_.begin(), segments_.end(),
            [](const SegmentOfSite& a, const SegmentOfSite& b) { return a.key < b.key; });
  for (std::size_t i = 0; i < segments_.size(); ++i)
    if (i == 0 || segments_[i - 1].key != segments_[i].key)
      sites_[segments_[i].key >> 32].sides[1].length_um += segments_[i].length_um;
  return sites_;
}

}  // namespace filiform::internal
