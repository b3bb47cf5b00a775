// Measures: the sums from which all features of a section, a neurite, a cell or a set follow. MEASURES.md defines the
// features, with formula and unit. Thread rule: values and functions without state.
#pragma once

#include "index/geometry/grid.h"

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

struct SomaShape;

// A mean and the largest value of some things.
struct MeasureSum {
  double sum = 0, most = -std::numeric_limits<double>::infinity();
  std::uint64_t count = 0;
  void add(double value) { sum += value, most = value > most ? value : most, ++count; }
  void add(const MeasureSum& other);
};

struct Measures {
  std::uint64_t cells = 0, neurites = 0, sections = 0, segments = 0, bifurcations = 0, forks = 0, tips = 0, loops = 0,
                zero_segments = 0, unknown_radii = 0;
  double length_um = 0, area_um2 = 0, volume_um3 = 0, soma_link_um = 0;
  MeasureSum section_length_um, section_radial_um, tip_path_um, tip_radial_um, branch_order, strahler_order;
  MeasureSum asymmetry, asymmetry_uylings, remote_angle_rad, local_angle_rad, sibling_ratio, diameter_power, tortuosity,
      taper;
  Vector3d lo_um = Vector3d::Constant(std::numeric_limits<double>::infinity());
  Vector3d hi_um = Vector3d::Constant(-std::numeric_limits<double>::infinity());
  std::array<MeasureSum, 3> extents_um;  // along principal axes, by neurite
  // By sphere: crossings, and segments whose ends lie on both sides. Only if asked for, and only with a soma.
  std::vector<std::uint64_t> sholl, sholl_by_ends;

  void add(const Measures& other);
};

// A number that describes a section, a neurite, a cell or a set.
struct Feature {
  std::string_view name, unit;  // unit: um, um2, um3, rad, or empty
  // NaN if the thing has no such number. `soma`: of a cell, else nullptr.
  double (*value)(const Measures& measures, const SomaShape* soma);
  bool is_count;  // a whole number
};

// All features, in the order of tables.
std::span<const Feature> features();
// By its name, with or without its unit: `length`, `length_um`. nullptr if there is none.
const Feature* findFeature(std::string_view name);
// The name with the unit, as tables show it: `length_um`.
std::string titleOf(const Feature& feature);

}  // namespace filiform
