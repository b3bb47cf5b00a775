// Grows synthetic neurons: the shapes behind tools/synthetic/synthetic.h. Functions without state; the same arguments
// give the same samples on every machine.
#pragma once

#include "index/cell/cell.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace filiform::tools {

inline constexpr double kColumnHeight_um = 1400;
inline constexpr double kColumnRadius_um = 150;

struct NeuronSample {
  std::array<std::int64_t, 3> p_nm;  // thousandths of um, so that three decimals are exact
  std::int64_t radius_nm;
  std::uint32_t parent;  // rank, kNoParent for a root
  std::uint16_t type;
};

struct Neuron {
  std::string description;  // "thick-tufted pyramidal cell, layer L5"
  std::vector<NeuronSample> samples;
};

// The layer, 1 to 6, of this cell in any column with this seed.
int layerOfCell(std::uint64_t seed, std::uint64_t number);

// Grows one neuron of a column. With `on_axis` the soma lies at x = z = 0. O(samples).
Neuron growNeuron(std::uint64_t seed, std::uint64_t number, bool on_axis = false);

// Builds the scene of a kind of sceneKinds(). `tip` becomes the rank of the last sample of the suggested route.
Neuron buildScene(const std::string& kind, std::uint32_t& tip);

// A random generator that does not depend on the library: xoshiro256++, seeded by splitmix64.
class SyntheticRandom {
 public:
  SyntheticRandom(std::uint64_t seed, std::uint64_t stream);
  std::uint64_t bits();
  double uniform();  // [0, 1)
  double between(double lo, double hi) { return lo + (hi - lo) * uniform(); }
  double gaussian();     // mean 0, deviation 1, within +-4.9 (a sum of eight)
  Vector3d direction();  // uniform on the sphere
  Vector3d inDisc();     // (x, 0, z), uniform, radius 1

 private:
  std::array<std::uint64_t, 4> state_;
};

}  // namespace filiform::tools
