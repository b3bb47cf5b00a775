// Builds the samples of a synthetic scene from straight runs. Thread-compatible.
#pragma once

#include "tools/synthetic/synthetic_neuron.h"

#include <cstdint>
#include <utility>
#include <vector>

namespace filiform::tools {

class SyntheticPath {
 public:
  // Divides a straight run into steps of about `step_um`. A parabola rounds each corner; it begins and ends `corner_um`
  // from the corner. 0 leaves corners sharp.
  explicit SyntheticPath(double step_um, double corner_um = 0) : step_um_(step_um), corner_um_(corner_um) {}

  std::uint32_t root(const Vector3d& p_um) { return add(p_um, kNoParent); }
  // Adds straight runs from sample `from` through the corners (um). Returns the rank of the last sample.
  std::uint32_t follow(std::uint32_t from, const std::vector<Vector3d>& corners_um);
  Vector3d at(std::uint32_t sample) const;  // um

  // Returns the neuron. Call once, at the end.
  Neuron take() { return std::move(neuron_); }

 private:
  std::uint32_t run(std::uint32_t from, const Vector3d& to_um);
  std::uint32_t add(const Vector3d& p_um, std::uint32_t parent);

  double step_um_, corner_um_;
  Neuron neuron_;
};

}  // namespace filiform::tools
