#include "index/compare/trace_distance.h"

#include "index/compare/internal/trace_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace filiform {
namespace {

using internal::TraceTree;
using PartOfSegment = std::pair<double, double>;
using EndPoints = std::array<Vector3d, 2>;

constexpr double kPiecesOfWithin = 20;
constexpr std::size_t kPlacesBetweenChecks = 4096;

// The t in [from, to] with |w0 + t w| <= within.
std::optional<PartOfSegment> withinOf(const Vector3d& w0, const Vector3d& w, double within2, double from, double to) {
  const double a = w.squaredNorm(), b = w0.dot(w), c = w0.squaredNorm() - within2;
  if (a == 0) return c <= 0 ? std::optional(PartOfSegment{from, to}) : std::nullopt;
  const double discriminant = b * b - a * c;
  if (discriminant < 0) return std::nullopt;
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  const double one = q / a, other = q == 0 ? 0 : c / q;
  const PartOfSegment found{std::max(from, std::min(one, other)), std::min(to, std::max(one, other))};
  return found.first <= found.second ? std::optional(found) : std::nullopt;
}

// The t in [0, 1] of the points of `s` within the distance of `other`: one interval, as both are convex. It is put
// together from the parts that are nearest to an end of `other`, and to its inside.
std::optional<PartOfSegment> withinOf(const EndPoints& s, const EndPoints& other, double within2) {
  const Vector3d d = s[1] - s[0], e = other[1] - other[0], r = s[0] - other[0];
  const double ee = e.squaredNorm(), de = d.dot(e), re = r.dot(e);
  std::array<double, 4> cuts{0, 0, 1, 1};  // between the parts
  if (de != 0) {
    cuts[1] = std::clamp(-re / de, 0.0, 1.0);
    cuts[2] = std::clamp((ee - re) / de, 0.0, 1.0);
    if (cuts[1] > cuts[2]) std::swap(cuts[1], cuts[2]);
  }
  std::optional<PartOfSegment> all;
  for (std::size_t i = 0; i < 3; ++i) {
    const double from = cuts[i], to = cuts[i + 1];
    if (from == to) continue;
    const double along = re + (from + to) / 2 * de;
    std::optional<PartOfSegment> part;
    if (along <= 0)
      part = withinOf(r, d, within2, from, to);
    else if (along >= ee)
      part = withinOf(s[0] - other[1], d, within2, from, to);
    else
      part = withinOf(r - re / ee * e, d - de / ee * e, within2, from, to);
    if (!part) continue;
    all = all ? PartOfSegment{std::min(all->first, part->first), std::max(all->second, part->second)} : part;
  }
  return all;
}

// The part of [0, 1] that the intervals cover.
double covered(std::vector<PartOfSegment>& intervals) {
  std::sort(intervals.begin(), intervals.end());
  double sum = 0, end = 0;
  for (const auto& [first, last] : intervals) {
    if (last > end) sum += last - std::max(first, end);
    end = std::max(end, last);
  }
  return sum;
}

struct MeasuredPlace {
  double distance_um, length_um;
};

double medianByLength(std::vector<MeasuredPlace>& places, double length_um) {
  std::sort(places.begin(), places.end(),
            [](const MeasuredPlace& a, const MeasuredPlace& b) { return a.distance_um < b.distance_um; });
  double sum = 0;
  for (const MeasuredPlace& place : places)
    if ((sum += place.length_um) >= length_um / 2) return place.distance_um;
  return places.back().distance_um;
}

}  // namespace

TraceDistance traceDistance(const CellGraph& from, const CellGraph& to, const TraceDistanceOptions& options) {
  const TraceTree tree(to);
  TraceDistance result;
  result.mean_um = result.median_um = result.max_um = std::numeric_limits<double>::quiet_NaN();
  const auto links = parentLinks(from);
  for (const auto& [parent, child] : links)
    result.length_um += (from.position_W(parent) - from.position_W(child)).norm();
  result.step_um = std::max(options.within_um / kPiecesOfWithin,
                            result.length_um / static_cast<double>(std::max<std::uint64_t>(options.most_places, 1)));
  if (!(result.length_um > 0)) return result;

  std::uint32_t near = 0;
  double max_um = 0, sum = 0;
  std::vector<MeasuredPlace> places;
  std::vector<PartOfSegment> intervals;
  const auto look = [&](const Vector3d& p_W) {
    const double distance_um = tree.distance_um(p_W, near);
    max_um = std::max(max_um, distance_um);
    return distance_um;
  };
  std::size_t looked = 0;
  const auto checkNow = [&] {
    if (options.check && looked++ % kPlacesBetweenChecks == 0) options.check();
  };
  for (const auto& [parent, child] : links) {
    const EndPoints ends{from.position_W(child), from.position_W(parent)};
    const Vector3d d = ends[1] - ends[0];
    const double length_um = d.norm();
    checkNow();
    look(ends[0]);
    look(ends[1]);
    if (length_um == 0) continue;
    const Vector3d around = Vector3d::Constant(options.within_um);
    intervals.clear();
    tree.forEachIn({ends[0].cwiseMin(ends[1]) - around, ends[0].cwiseMax(ends[1]) + around},
                   [&](const TraceTree::Segment& segment) {
                     if (const auto part = withinOf(ends, segment.ends_W, options.within_um * options.within_um))
                       intervals.push_back(*part);
                   });
    result.within_length_um += length_um * covered(intervals);
    const double pieces = std::ceil(length_um / result.step_um);
    for (double i = 0; i < pieces; ++i) {
      checkNow();
      places.push_back({look(ends[0] + (i + 0.5) / pieces * d), length_um / pieces});
      sum += places.back().distance_um * places.back().length_um;
    }
  }
  result.mean_um = sum / result.length_um;
  result.median_um = medianByLength(places, result.length_um);
  result.max_um = max_um;
  return result;
}

}  // namespace filiform
