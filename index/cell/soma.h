// What the soma samples of a cell mean. SWC has three forms: one sample (a sphere), three samples (also a sphere) and
// many samples around the outline. Samples are never changed; drawing, routes and forks use the sphere instead.
//
// Only somata at a root are considered. Such a root has type 1. Its soma samples are those connected to it by links
// between samples of type 1. Thread rule: values and functions without state.
#pragma once

#include "index/cell/cell.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace filiform {

inline constexpr std::uint16_t kSomaType = 1;

struct Soma {
  enum class Form : std::uint8_t {
    kThreePoint,  // the root is the centre; two samples lie one radius from it on opposite sides (NeuroMorpho)
    kContour,     // an unbranched run of thin samples around the outline; ends near its start
  };
  Form form = Form::kThreePoint;
  std::uint32_t root = 0;  // rank
  Vector3d centre_um = Vector3d::Zero();
  double radius_um = 0;
  std::vector<std::uint32_t> samples;    // ranks of all its samples except the root, ascending
  std::vector<std::uint32_t> dead_ends;  // of these, samples without a neurite: no branch points or tips; ascending

  bool isDeadEnd(std::uint32_t rank) const;  // O(log samples)
};

// One sample of a soma, as input of somaOf(): the root first, the others in any order.
struct SomaSample {
  std::uint32_t rank = 0;
  std::uint32_t parent = 0;  // position of the parent in the list; 0 for the root
  Vector3d p_um = Vector3d::Zero();
  float radius_um = 0;
  bool has_neurite = false;  // a sample of another type is its child
};

inline constexpr std::size_t kMostSomaSamples = 512;  // more samples: not an outline
inline constexpr double kThreePointTolerance = 0.01;  // of the radius

// Result for three soma samples: kYes if they form a three-point soma, kOff if they do not and are taken as they are.
enum class ThreePoint : std::uint8_t { kNo, kOff, kYes };

// somaOf: the soma that the samples of one root mean. nullopt if the samples mean only themselves. threePointOf:
// whether the samples form a three-point soma. `slack_um`: the largest distance by which rounding may have moved a
// sample. O(n log n).
std::optional<Soma> somaOf(std::span<const SomaSample> samples, double slack_um = 0);
ThreePoint threePointOf(std::span<const SomaSample> samples, double slack_um = 0);

struct CellSomata {
  std::vector<Soma> somata;              // by rank of the root
  std::vector<std::uint32_t> off_roots;  // roots of somata with ThreePoint::kOff
};

// The somata of a whole cell; empty for a cell with loops. O(samples).
CellSomata somataOf(const Cell& cell);
// Like somataOf(cell), from arrays of equal length by rank; calls position_um(rank) for soma samples alone. `slack_um`
// as above.
CellSomata somataOf(std::span<const std::uint32_t> parents,
                    const std::function<Vector3d(std::uint32_t rank)>& position_um, std::span<const float> radii_um,
                    std::span<const std::uint16_t> types, double slack_um = 0);

}  // namespace filiform
