#include "tools/synthetic/synthetic_fan.h"

#include "index/errors.h"
#include "tools/synthetic/synthetic_path.h"
#include "tools/synthetic/synthetic_swc.h"
#include "tools/synthetic/thousandths.h"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

namespace filiform::tools {

namespace {

constexpr double kStem_um = 60;

struct SineCosine {
  double sine, cosine;
};

// Sums the power series, because the C library's functions may differ in the last bit between machines. Exact to 1e-12
// for |x| <= 2 pi.
SineCosine sineCosineOf(double x) {
  double sine = 0, cosine = 0, term = 1;  // term = x^n / n!
  for (int n = 0; n < 40; n += 2) {
    const double sign = n % 4 == 0 ? 1 : -1;
    cosine += sign * term;
    term *= x / (n + 1);
    sine += sign * term;
    term *= x / (n + 2);
  }
  return {sine, cosine};
}

struct Frame {  // three unit vectors at right angles
  Vector3d ahead, side, up;

  static Frame about(const Vector3d& ahead, SyntheticRandom& random) {
    Vector3d side;
    do side = ahead.cross(random.direction());
    while (side.squaredNorm() < 0.01);
    side.normalize();
    return {ahead, side, ahead.cross(side)};
  }
  // The direction at `angle_rad` from `ahead`, at `azimuth_rad` around `ahead`.
  Vector3d direction(double angle_rad, double azimuth_rad) const {
    const SineCosine a = sineCosineOf(angle_rad), z = sineCosineOf(azimuth_rad);
    return a.cosine * ahead + a.sine * (z.cosine * side + z.sine * up);
  }
};

std::string thousandths(double value) {
  std::string out;
  appendThousandths(out, std::llround(1000 * value));
  return out;
}

// A straight run along `frame.ahead` from the node, then two sharp elbows.
std::vector<Vector3d> elbowedBranch(const Frame& frame, SyntheticRandom& random) {
  const double length_um[3] = {random.between(30, 50), random.between(30, 50), random.between(30, 50)};
  const double turn_rad[2] = {random.between(1.7, 2.2), random.between(1.7, 2.2)};
  const double azimuth = random.between(0, 2 * std::numbers::pi), twist = random.between(-0.5, 0.5);
  Vector3d p = length_um[0] * frame.ahead;
  std::vector<Vector3d> corners{p};
  const Vector3d back = frame.direction(turn_rad[0], azimuth);
  p += length_um[1] * back;
  corners.push_back(p);
  // The second elbow turns away from the other branches: in the plane of the first elbow, within half a radian.
  const Vector3d across = (frame.ahead - frame.ahead.dot(back) * back).normalized();
  const Frame second{back, across, back.cross(across)};
  p += length_um[2] * second.direction(turn_rad[1], twist);
  corners.push_back(p);
  return corners;
}

}  // namespace

Fan buildFan(const FanOptions& options) {
  if (options.branches < 2) throw UsageError("a fan needs at least 2 branches");
  if (!(options.cone_rad >= 0 && options.cone_rad <= std::numbers::pi / 2))
    throw UsageError("the cone of a fan must be 0 to pi / 2 rad");
  if (!(options.segment_um > 0 && std::isfinite(options.segment_um)))
    throw UsageError("the segments of a fan must be > 0 um");
  SyntheticRandom random(options.seed ^ 0x66616eU, static_cast<std::uint64_t>(options.branches));
  const Frame frame = Frame::about(random.direction(), random);
  SyntheticPath path(options.segment_um);
  const std::uint32_t root = path.root(-kStem_um * frame.ahead);
  const std::uint32_t node = path.follow(root, {Vector3d::Zero()});

  const std::vector<Vector3d> wanted = elbowedBranch(frame, random);
  const int others = options.branches - 1;
  const int place = static_cast<int>(random.uniform() * options.branches);  // position of the wanted branch in the file
  std::uint32_t tip = 0;
  for (int i = 0, other = 0; i < options.branches; ++i) {
    if (i == place) {
      tip = path.follow(node, wanted);
      continue;
    }
    const double azimuth = 2 * std::numbers::pi * (other++ + random.between(-0.25, 0.25)) / others;
    const Vector3d ahead = frame.direction(options.cone_rad, azimuth);
    if (options.alike) {
      path.follow(node, elbowedBranch(Frame::about(ahead, random), random));
    } else {
      path.follow(node, {random.between(60, 100) * ahead});
    }
  }

  Fan fan;
  fan.neuron = path.take();
  fan.last = tip;
  fan.text = swcText(fan.neuron, {"fan: " + std::to_string(options.branches) + " branches within " +
                                      thousandths(options.cone_rad) + " rad of the wanted one, segments of about " +
                                      thousandths(options.segment_um) + " um, seed " + std::to_string(options.seed),
                                  "suggested route (sample ids ROOT:TIP): 1:" + std::to_string(tip + 1)});
  fan.cell = cellOf(fan.neuron, fan.text,
                    "fan_" + std::to_string(options.branches) + "_" + std::to_string(options.seed) + ".swc");
  return fan;
}

FanOptions drawFan(std::uint64_t seed, std::uint64_t number, int branches) {
  SyntheticRandom random(seed ^ 0x66616e66616eU, number);
  FanOptions options;
  options.branches = branches;
  options.cone_rad = random.between(0.05, 0.6);
  options.segment_um = random.between(2, 30);
  options.alike = number % 2 == 1;
  options.seed = random.bits() >> 16;
  return options;
}

}  // namespace filiform::tools
