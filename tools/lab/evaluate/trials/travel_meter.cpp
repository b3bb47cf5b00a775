#include "tools/lab/evaluate/trials/travel_meter.h"

#include <algorithm>
#include <cmath>

namespace filiform::tools {

double TravelMeter::depth(const ProxyPlace& place) const noexcept {
  const std::uint32_t child = place.segment.segment, parent = cell_.graph().parents[child];
  const double child_um = cell_.depth_um(child);
  return parent == kNoParent ? child_um : child_um + place.t * (cell_.depth_um(parent) - child_um);
}

// Arc length along the tree: from both places to the node where their ways to the root meet.
double TravelMeter::distance(const ProxyPlace& a, const ProxyPlace& b) const noexcept {
  const std::vector<std::uint32_t>& parents = cell_.graph().parents;
  std::uint32_t at = a.segment.segment, bt = b.segment.segment;
  const std::uint32_t a_child = at, b_child = bt;
  const double a_um = depth(a), b_um = depth(b);
  if (at == bt) return std::abs(a_um - b_um);
  if (cell_.root(at) != cell_.root(bt)) return 0;
  while (at != bt) {
    const std::uint32_t a_level = cell_.level(at), b_level = cell_.level(bt);
    if (a_level >= b_level) at = parents[at];
    if (b_level >= a_level) bt = parents[bt];
  }
  // A place lies above its segment's child. If the ways meet at that child, the place itself is the meeting.
  const double meeting_um = at == a_child ? a_um : at == b_child ? b_um : cell_.depth_um(at);
  return std::max(0.0, a_um - meeting_um) + std::max(0.0, b_um - meeting_um);
}

void TravelMeter::update(const ProxyPlace& place) noexcept {
  const double arc_um = route_.progress(place).arc_um;
  if (last_.valid() && place.valid() && (place.segment != last_.segment || place.t != last_.t)) {
    const double along_um = std::abs(arc_um - last_arc_um_);
    off_um_ += std::max(0.0, distance(last_, place) - along_um);
    if (along_um > leap_um_ && along_um > kLeapChords * (place.p_W - last_.p_W).norm()) skip_um_ += along_um;
  }
  last_ = place;
  last_arc_um_ = arc_um;
}

}  // namespace filiform::tools
