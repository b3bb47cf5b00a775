#include "index/contacts/internal/site_merger.h"

#include <algorithm>
#include <tuple>

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

std::span<const ContactSite> SiteMerger::merge(std::span<const ContactPair> pairs) {
  const auto count = static_cast<std::uint32_t>(pairs.size());
  joined_.clear();
  before_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    before_[i] = i;
    const ContactPair& p = pairs[i];
    for (const std::uint32_t a : {p.child[0], p.parent[0]})
      for (const std::uint32_t b : {p.child[1], p.parent[1]}) joined_.push_back({std::uint64_t{a} << 32 | b, i});
  }
  if (count > 1)
    std::sort(joined_.begin(), joined_.end(), [](const Joined& a, const Joined& b) { return a.samples < b.samples; });
  for (std::size_t i = 1; i < joined_.size(); ++i) {
    if (joined_[i - 1].samples != joined_[i].samples) continue;
    const std::uint32_t a = root(joined_[i - 1].pair), b = root(joined_[i].pair);
    before_[std::max(a, b)] = std::min(a, b);
  }
  sites_.clear();
  site_of_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t first = root(i);
    if (first == i) {
      site_of_[i] = static_cast<std::uint32_t>(sites_.size());
      setNearest(sites_.emplace_back(), pairs[i]);
    }
    ContactSite& site = sites_[site_of_[i] = site_of_[first]];
    ++site.pairs;
    if (pairs[i].distance_um < site.distance_um) setNearest(site, pairs[i]);
  }
  for (const std::size_t side : {0, 1}) {
    segments_.clear();
    for (std::uint32_t i = 0; i < count; ++i)
      segments_.push_back({site_of_[i], pairs[i].segment[side], pairs[i].length_um[side]});
    const auto key = [](const SegmentOfSite& s) { return std::tie(s.site, s.segment); };
    std::sort(segments_.begin(), segments_.end(),
              [&](const SegmentOfSite& a, const SegmentOfSite& b) { return key(a) < key(b); });
    for (std::size_t i = 0; i < segments_.size(); ++i)
      if (i == 0 || key(segments_[i - 1]) != key(segments_[i]))
        sites_[segments_[i].site].sides[side].length_um += segments_[i].length_um;
  }
  return sites_;
}

}  // namespace filiform::internal
