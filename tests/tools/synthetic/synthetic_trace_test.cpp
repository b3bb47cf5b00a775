#include "tools/synthetic/synthetic_trace.h"

#include "index/errors.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

bool sameSamples(const Neuron& a, const Neuron& b) {
  return std::equal(a.samples.begin(), a.samples.end(), b.samples.begin(), b.samples.end(),
                    [](const NeuronSample& x, const NeuronSample& y) {
                      return x.p_nm == y.p_nm && x.parent == y.parent && x.type == y.type;
                    });
}

TEST(SyntheticTrace, ALatticeTraceStepsFromVoxelToNeighbouringVoxel) {
  constexpr std::int64_t kVoxel_nm = 700;
  const Neuron neuron = growNeuron(3, 5), traced = onLattice(neuron, 0.7);
  std::uint64_t steps = 0;
  for (const NeuronSample& sample : traced.samples) {
    if (sample.parent == kNoParent || sample.type == 1) continue;
    const NeuronSample& before = traced.samples[sample.parent];
    if (before.type == 1) continue;  // somata are not on the lattice
    std::int64_t most = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ASSERT_EQ(sample.p_nm[axis] % kVoxel_nm, 0);
      most = std::max<std::int64_t>(most, std::abs(sample.p_nm[axis] - before.p_nm[axis]));
    }
    ASSERT_EQ(most, kVoxel_nm);
    ++steps;
  }
  EXPECT_GT(steps, neuron.samples.size());
}

TEST(SyntheticTrace, EveryTipOfTheNeuronIsATipWithinHalfAVoxelDiagonal) {
  const Neuron neuron = growNeuron(3, 6), traced = onLattice(neuron, 1.3);
  const auto tips = [](const Neuron& of) {
    std::vector<bool> has_child(of.samples.size(), false);
    for (const NeuronSample& sample : of.samples)
      if (sample.parent != kNoParent) has_child[sample.parent] = true;
    return std::count(has_child.begin(), has_child.end(), false);
  };
  EXPECT_GE(tips(neuron), tips(traced));
  EXPECT_GT(tips(traced), tips(neuron) * 9 / 10);  // a twig shorter than a voxel is lost
}

TEST(SyntheticTrace, JitterMovesDepthAlone) {
  const Neuron neuron = growNeuron(3, 7), jittered = withJitteredDepth(neuron, 0.8, 4);
  ASSERT_EQ(jittered.samples.size(), neuron.samples.size());
  double sum2 = 0;
  std::size_t moved = 0;
  for (std::size_t i = 0; i < neuron.samples.size(); ++i) {
    ASSERT_EQ(jittered.samples[i].p_nm[0], neuron.samples[i].p_nm[0]);
    ASSERT_EQ(jittered.samples[i].p_nm[1], neuron.samples[i].p_nm[1]);
    const double shift_um = 1e-3 * static_cast<double>(jittered.samples[i].p_nm[2] - neuron.samples[i].p_nm[2]);
    if (neuron.samples[i].type == 1) {
      ASSERT_EQ(shift_um, 0);
    } else {
      sum2 += shift_um * shift_um;
      ++moved;
    }
  }
  EXPECT_NEAR(std::sqrt(sum2 / static_cast<double>(moved)), 0.8, 0.08);
}

TEST(SyntheticTrace, TheSameArgumentsGiveTheSameTrace) {
  EXPECT_TRUE(sameSamples(drawTrace(2, 4), drawTrace(2, 4)));
  EXPECT_TRUE(sameSamples(drawTrace(2, 5), drawTrace(2, 5)));
  EXPECT_FALSE(sameSamples(drawTrace(2, 5), drawTrace(3, 5)));
}

TEST(SyntheticTrace, RefusesVoxelsAndJitterThatMakeNoSense) {
  const Neuron neuron = growNeuron(1, 1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double voxel_um : {0.0, -1.0, nan}) EXPECT_THROW(onLattice(neuron, voxel_um), UsageError);
  for (const double rms_um : {-1.0, nan}) EXPECT_THROW(withJitteredDepth(neuron, rms_um, 1), UsageError);
}

}  // namespace
}  // namespace filiform::tools
