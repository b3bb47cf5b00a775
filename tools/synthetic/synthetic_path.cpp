#include "tools/synthetic/synthetic_path.h"

#include <algorithm>
#include <cmath>

namespace filiform::tools {

namespace {

constexpr std::uint16_t kDendrite = 3;
constexpr std::int64_t kPathRadius_nm = 1000;

}  // namespace

std::uint32_t SyntheticPath::follow(std::uint32_t from, const std::vector<Vector3d>& corners_um) {
  for (std::size_t i = 0; i < corners_um.size(); ++i) {
    const Vector3d& corner = corners_um[i];
    if (i + 1 == corners_um.size() || !(corner_um_ > 0)) {
      from = run(from, corner);
      continue;
    }
    const Vector3d in = corner + corner_um_ * (at(from) - corner).normalized();
    const Vector3d out = corner + corner_um_ * (corners_um[i + 1] - corner).normalized();
    from = run(from, in);
    for (const double t : {0.25, 0.5, 0.75, 1.0})
      from = add((1 - t) * (1 - t) * in + 2 * t * (1 - t) * corner + t * t * out, from);
  }
  return from;
}

Vector3d SyntheticPath::at(std::uint32_t sample) const {
  const auto& p = neuron_.samples[sample].p_nm;
  return Vector3d(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])) / 1000;
}

std::uint32_t SyntheticPath::run(std::uint32_t from, const Vector3d& to_um) {
  const Vector3d start = at(from);
  const int steps = std::max(1, static_cast<int>(std::lround((to_um - start).norm() / step_um_)));
  for (int i = 1; i <= steps; ++i) from = add(start + (to_um - start) * (static_cast<double>(i) / steps), from);
  return from;
}

std::uint32_t SyntheticPath::add(const Vector3d& p_um, std::uint32_t parent) {
  NeuronSample sample{};
  for (int i = 0; i < 3; ++i) sample.p_nm[static_cast<std::size_t>(i)] = std::llround(p_um[i] * 1000);
  sample.radius_nm = kPathRadius_nm;
  sample.parent = parent;
  sample.type = kDendrite;
  neuron_.samples.push_back(sample);
  return static_cast<std::uint32_t>(neuron_.samples.size() - 1);
}

}  // namespace filiform::tools
