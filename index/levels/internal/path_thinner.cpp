#include "index/levels/internal/path_thinner.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

namespace filiform {
namespace {

// Parts of the tolerance. At each position along the frame, a passed sample lies within kAcross of the line on both
// other axes: together kAcross * sqrt(2). A sample may lie kBehind beyond the end, which adds kBehind * sqrt(2),
// because the line is at most 45 degrees from the frame. All samples before the frame exists lie within kNear of the
// first.
constexpr double kAcross = 0.6, kBehind = 0.1, kNear = 0.5;

// The ends that a segment may have so that it passes near all samples since its start.
class Corridor {
 public:
  explicit Corridor(double tolerance_um)
      : across_um_(kAcross * tolerance_um),
        back_um_(kBehind * tolerance_um),
        near2_um2_(kNear * tolerance_um * kNear * tolerance_um) {}

  void start() { framed_ = false; }
  // True if the segment may end at `p`, um from its start; `p` then is one of the samples that it passes.
  bool passes(const Vector3d& p) {
    if (!framed_) {
      const double squared = p.squaredNorm();
      if (squared > near2_um2_) begin(p, std::sqrt(squared));
      return true;
    }
    const double t = along_.dot(p), u = right_.dot(p), v = up_.dot(p);
    if (t < farthest_um_ - back_um_) return false;
    const double one = 1 / t, slope_u = u * one, slope_v = v * one, margin = across_um_ * one;
    if (slope_u < least_u_ || slope_u > most_u_ || slope_v < least_v_ || slope_v > most_v_) return false;
    if (slope_u * slope_u + slope_v * slope_v > 1) return false;
    least_u_ = std::max(least_u_, slope_u - margin), most_u_ = std::min(most_u_, slope_u + margin);
    least_v_ = std::max(least_v_, slope_v - margin), most_v_ = std::min(most_v_, slope_v + margin);
    farthest_um_ = std::max(farthest_um_, t);
    return true;
  }

 private:
  void begin(const Vector3d& p, double distance_um) {
    framed_ = true;
    along_ = p / distance_um;
    right_ = along_.unitOrthogonal();
    up_ = along_.cross(right_);
    farthest_um_ = distance_um;
    most_u_ = most_v_ = across_um_ / distance_um;
    least_u_ = least_v_ = -most_u_;
  }

  double across_um_, back_um_, near2_um2_;
  bool framed_ = false;
  Vector3d along_, right_, up_;
  double farthest_um_ = 0, least_u_ = 0, most_u_ = 0, least_v_ = 0, most_v_ = 0;
};

class PathThinner {
 public:
  PathThinner(const Grid& grid, double tolerance_um, std::size_t segments)
      : quantum_um_(grid.quantum_um()), tolerance_um_(tolerance_um), corridor_(tolerance_um) {
    out_.points.reserve(segments / 2 + 1);
  }

  void add(const StoredSegment& s, float radius_um, std::uint16_t type) {
    ++out_.represented;
    if (s.child_sample == s.parent_sample) {
      end();
      out_.paths.push_back({s.id.cell, s.child_sample, s.child_sample, kNoSample, pointCount(), 1});
      out_.points.push_back({s.child, radius_um, type, 1});
      return;
    }
    const bool continues = open_ && out_.paths.back().cell == s.id.cell &&
                           out_.paths.back().last_sample == s.parent_sample && s.child_sample == s.parent_sample + 1;
    if (!continues) begin(s, radius_um, type);
    const Vector3d p = (s.child - start_).cast<double>() * quantum_um_;
    if (!corridor_.passes(p)) {
      put();
      corridor_.passes((s.child - start_).cast<double>() * quantum_um_);
    }
    out_.paths.back().last_sample = s.child_sample;
    last_.p = s.child;
    last_.type = type;
    ++last_.segments;
    if (radius_um == radius_um) {  // known
      radius_sum_ += static_cast<double>(radius_um);
      ++radii_;
    }
  }
  Neurites take() {
    end();
    if (merged_) out_.error_um = tolerance_um_;
    return std::move(out_);
  }

 private:
  std::uint32_t pointCount() const { return static_cast<std::uint32_t>(out_.points.size()); }
  void begin(const StoredSegment& s, float radius_um, std::uint16_t type) {
    end();
    out_.paths.push_back({s.id.cell, s.parent_sample, s.parent_sample, s.child_sample, pointCount(), 0});
    out_.points.push_back({s.parent, radius_um, type, 0});
    start_ = s.parent;
    corridor_.start();
    open_ = true;
  }
  // Ends the segment at the last sample; the next one starts there.
  void put() {
    last_.radius_um = radii_ > 0 ? static_cast<float>(radius_sum_ / radii_) : std::numeric_limits<float>::quiet_NaN();
    merged_ |= last_.segments > 1;
    out_.points.push_back(last_);
    start_ = last_.p;
    last_.segments = 0;
    radius_sum_ = radii_ = 0;
    corridor_.start();
  }
  void end() {
    if (!open_) return;
    put();
    out_.paths.back().count = pointCount() - out_.paths.back().begin;
    open_ = false;
  }

  double quantum_um_, tolerance_um_;
  Corridor corridor_;
  Neurites out_;
  bool open_ = false, merged_ = false;
  GridPoint start_ = GridPoint::Zero();  // of the segment at work
  NeuritePoint last_;                    // its end so far
  double radius_sum_ = 0, radii_ = 0;
};

}  // namespace

Neurites thinned(std::span<const StoredSegment> segments, const TileAppearance& appearance, const Grid& grid,
                 double tolerance_um) {
  PathThinner thinner(grid, tolerance_um, segments.size());
  std::size_t owned = 0;
  for (const StoredSegment& s : segments) {
    if (!s.owned) continue;
    thinner.add(s, appearance.radii_um[owned], appearance.types[owned]);
    ++owned;
  }
  Neurites thin = thinner.take();
  // Samples in no order make runs of one segment. The slower way links them first.
  constexpr std::size_t kShort = 2;  // segments of a run
  if (thin.paths.size() * kShort <= thin.represented) return thin;
  Neurites whole = neuritesOf(segments, appearance);
  simplify(whole, grid, tolerance_um);
  return whole;
}

}  // namespace filiform
