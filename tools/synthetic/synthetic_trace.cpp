#include "tools/synthetic/synthetic_trace.h"

#include "index/errors.h"
#include "tools/synthetic/thousandths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace filiform::tools {

namespace {

constexpr std::uint16_t kSomaOfTrace = 1;

using Voxel = std::array<std::int64_t, 3>;

Vector3d sampleAt_um(const NeuronSample& sample) {
  return Vector3d(static_cast<double>(sample.p_nm[0]), static_cast<double>(sample.p_nm[1]),
                  static_cast<double>(sample.p_nm[2])) /
         1000;
}

std::string shortNumber(double value) {
  std::string out;
  appendThousandths(out, std::llround(1000 * value));
  return out;
}

class Lattice {
 public:
  explicit Lattice(double voxel_um) : voxel_um_(voxel_um) {}

  Voxel at(const Vector3d& p_um) const {
    return {std::llround(p_um.x() / voxel_um_), std::llround(p_um.y() / voxel_um_), std::llround(p_um.z() / voxel_um_)};
  }
  NeuronSample sample(const Voxel& voxel, const NeuronSample& like, std::uint32_t parent) const {
    NeuronSample made = like;
    for (std::size_t axis = 0; axis < 3; ++axis)
      made.p_nm[axis] = std::llround(1000 * voxel_um_ * static_cast<double>(voxel[axis]));
    made.parent = parent;
    return made;
  }
  // Calls met(voxel) for each voxel on the way from `from` to `to` except the first. Each is a neighbour of the
  // previous one.
  template <typename Met>
  void walk(const Vector3d& from_um, const Vector3d& to_um, const Met& met) const {
    Voxel last = at(from_um);
    // A step passes at most half a voxel on any axis, so that no neighbour is skipped.
    const int steps = std::max(1, static_cast<int>(std::ceil(2 * (to_um - from_um).norm() / voxel_um_)));
    for (int i = 1; i <= steps; ++i) {
      const Voxel next = i == steps ? at(to_um) : at(from_um + (to_um - from_um) * (static_cast<double>(i) / steps));
      if (next != last) met(next);
      last = next;
    }
  }

 private:
  double voxel_um_;
};

}  // namespace

Neuron onLattice(const Neuron& neuron, double voxel_um) {
  if (!(voxel_um >= 0.01 && std::isfinite(voxel_um))) throw UsageError("the voxels of a trace must be >= 0.01 um");
  const Lattice lattice(voxel_um);
  Neuron traced;
  traced.description = neuron.description + ", traced on a lattice of " + shortNumber(voxel_um) + " um";
  std::vector<std::uint32_t> rank(neuron.samples.size());  // by sample: its rank, or that of the sample in its voxel
  const auto add = [&](const NeuronSample& sample) {
    traced.samples.push_back(sample);
    return static_cast<std::uint32_t>(traced.samples.size() - 1);
  };
  for (std::size_t i = 0; i < neuron.samples.size(); ++i) {
    const NeuronSample& sample = neuron.samples[i];
    if (sample.parent == kNoParent || sample.type == kSomaOfTrace) {
      NeuronSample kept = sample;
      if (sample.parent != kNoParent) kept.parent = rank[sample.parent];
      rank[i] = add(kept);
      continue;
    }
    std::uint32_t last = rank[sample.parent];
    lattice.walk(sampleAt_um(neuron.samples[sample.parent]), sampleAt_um(sample),
                 [&](const Voxel& voxel) { last = add(lattice.sample(voxel, sample, last)); });
    rank[i] = last;
  }
  return traced;
}

Neuron withJitteredDepth(const Neuron& neuron, double rms_um, std::uint64_t seed) {
  if (!(rms_um >= 0 && std::isfinite(rms_um))) throw UsageError("the jitter of a depth must be >= 0 um and finite");
  SyntheticRandom random(seed ^ 0x6465707468U, 0);
  Neuron jittered = neuron;
  jittered.description += ", depth jittered by " + shortNumber(rms_um) + " um";
  for (NeuronSample& sample : jittered.samples) {
    const double shift_um = rms_um * random.gaussian();
    if (sample.type != kSomaOfTrace) sample.p_nm[2] += std::llround(1000 * shift_um);
  }
  return jittered;
}

Neuron drawTrace(std::uint64_t seed, std::uint64_t number) {
  SyntheticRandom random(seed ^ 0x7472616365U, number);
  const Neuron neuron = growNeuron(seed, number);
  const double voxel_um = random.between(0.3, 2), rms_um = random.between(0.3, 1.5);
  return number % 2 == 0 ? onLattice(neuron, voxel_um) : withJitteredDepth(neuron, rms_um, random.bits());
}

}  // namespace filiform::tools
