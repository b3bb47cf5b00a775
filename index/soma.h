// What the soma samples of a cell mean. SWC has three forms: one sample, a sphere; three samples, also a sphere; and
// many samples around its outline. Samples stay as they are; drawing, routes and forks take the sphere instead.
//
// Only somata that begin at a root are looked at: the root has type 1, and its soma samples are what hangs on it by
// links between samples of type 1.
#pragma once

#include "index/cell.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace filiform {

inline constexpr std::uint16_t kSomaType = 1;

struct Soma {
  enum class Form : std::uint8_t {
    kThreePoint,  // the root is the centre, two more samples lie one radius from it on opposite sides (NeuroMorpho)
    kContour,     // a chain of thin samples around the outline, which ends near where it began
  };
  Form form = Form::kThreePoint;
  std::uint32_t root = 0;  // rank
  Vector3d centre_um = Vector3d::Zero();
  double radius_um = 0;
  std::vector<std::uint32_t> samples;    // ranks of all its samples but the root, ascending
  std::vector<std::uint32_t> dead_ends;  // of these, what no neurite hangs on: neither branches nor tips; ascending

  bool isDeadEnd(std::uint32_t rank) const;  // O(log samples)
};

// A sample of a soma, in any order but the root first.
struct SomaSample {
  std::uint32_t rank = 0;
  std::uint32_t parent = 0;  // place in the list; the root's own for the root
  Vector3d p_um = Vector3d::Zero();
  float radius_um = 0;
  bool has_neurite = false;  // a sample of another type hangs on it
};

inline constexpr std::size_t kMostSomaSamples = 512;  // what has more is no outline
inline constexpr double kThreePointTolerance = 0.01;  // of the radius

// Is it three samples that do not lie as a three-point soma does? Then they are taken as they are.
enum class ThreePoint : std::uint8_t { kNo, kOff, kYes };

// The soma that the samples of one root mean; none where they mean nothing but themselves. `slack_um` is how far each
// sample may have been moved by rounding. O(n log n).
std::optional<Soma> somaOf(std::span<const SomaSample> samples, double slack_um = 0);
ThreePoint threePointOf(std::span<const SomaSample> samples, double slack_um = 0);

struct CellSomata {
  std::vector<Soma> somata;              // by root
  std::vector<std::uint32_t> off_roots;  // roots of somata with ThreePoint::kOff
};

// Of a whole cell; none of a cell with loops. O(samples).
CellSomata somataOf(const Cell& cell);
// The same from its parts. Requires spans of one length. `slack_um` as above.
CellSomata somataOf(std::span<const std::uint32_t> parents, std::span<const Vector3d> positions_um,
                    std::span<const float> radii_um, std::span<const std::uint16_t> types, double slack_um = 0);

}  // namespace filiform
