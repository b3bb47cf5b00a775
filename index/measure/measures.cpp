#include "index/measure/measures.h"

#include "index/measure/cell_tree.h"

#include <algorithm>
#include <iterator>

namespace filiform {
namespace {

constexpr double kNoMeasure = std::numeric_limits<double>::quiet_NaN();

double meanOf(const MeasureSum& s) { return s.count == 0 ? kNoMeasure : s.sum / static_cast<double>(s.count); }
double mostOf(const MeasureSum& s) { return s.count == 0 ? kNoMeasure : s.most; }
double rangeOf(const Measures& m, int axis) {
  return m.hi_um[axis] < m.lo_um[axis] ? kNoMeasure : m.hi_um[axis] - m.lo_um[axis];
}
double cornerOf(const Measures& m, double corner) { return m.hi_um[0] < m.lo_um[0] ? kNoMeasure : corner; }

void addBins(std::vector<std::uint64_t>& bins, const std::vector<std::uint64_t>& others) {
  if (bins.size() < others.size()) bins.resize(others.size());
  for (std::size_t i = 0; i < others.size(); ++i) bins[i] += others[i];
}

#define FILIFORM_COUNT(name)                                                                         \
  {                                                                                                  \
#name, "", [](const Measures& m, const SomaShape*) { return static_cast<double>(m.name); }, true \
  }
#define FILIFORM_VALUE(name, unit, value)                                                  \
  {                                                                                        \
    name, unit, [](const Measures& m, const SomaShape*) -> double { return value; }, false \
  }
#define FILIFORM_SOMA(name, unit, value)                                                                       \
  {                                                                                                            \
    name, unit, [](const Measures&, const SomaShape* s) { return s == nullptr ? kNoMeasure : (value); }, false \
  }

constexpr Feature kFeatures[] = {
    FILIFORM_COUNT(neurites),
    FILIFORM_COUNT(sections),
    FILIFORM_COUNT(segments),
    FILIFORM_COUNT(bifurcations),
    FILIFORM_COUNT(forks),
    FILIFORM_COUNT(tips),
    FILIFORM_COUNT(loops),
    FILIFORM_VALUE("length", "um", m.length_um),
    FILIFORM_VALUE("area", "um2", m.area_um2),
    FILIFORM_VALUE("volume", "um3", m.volume_um3),
    FILIFORM_VALUE("section_length_mean", "um", meanOf(m.section_length_um)),
    FILIFORM_VALUE("section_length_max", "um", mostOf(m.section_length_um)),
    FILIFORM_VALUE("tip_path_mean", "um", meanOf(m.tip_path_um)),
    FILIFORM_VALUE("tip_path_max", "um", mostOf(m.tip_path_um)),
    FILIFORM_VALUE("tip_radial_mean", "um", meanOf(m.tip_radial_um)),
    FILIFORM_VALUE("tip_radial_max", "um", mostOf(m.tip_radial_um)),
    FILIFORM_VALUE("section_radial_max", "um", mostOf(m.section_radial_um)),
    FILIFORM_VALUE("branch_order_mean", "", meanOf(m.branch_order)),
    {"branch_order_max", "", [](const Measures& m, const SomaShape*) { return mostOf(m.branch_order); }, true},
    {"strahler_max", "", [](const Measures& m, const SomaShape*) { return mostOf(m.strahler_order); }, true},
    FILIFORM_VALUE("asymmetry_mean", "", meanOf(m.asymmetry)),
    FILIFORM_VALUE("asymmetry_uylings_mean", "", meanOf(m.asymmetry_uylings)),
    FILIFORM_VALUE("remote_angle_mean", "rad", meanOf(m.remote_angle_rad)),
    FILIFORM_VALUE("local_angle_mean", "rad", meanOf(m.local_angle_rad)),
    FILIFORM_VALUE("tortuosity_mean", "", meanOf(m.tortuosity)),
    FILIFORM_VALUE("taper_mean", "", meanOf(m.taper)),
    FILIFORM_VALUE("sibling_ratio_mean", "", meanOf(m.sibling_ratio)),
    FILIFORM_VALUE("diameter_power_mean", "", meanOf(m.diameter_power)),
    FILIFORM_VALUE("width", "um", rangeOf(m, 0)),
    FILIFORM_VALUE("height", "um", rangeOf(m, 1)),
    FILIFORM_VALUE("depth", "um", rangeOf(m, 2)),
    FILIFORM_VALUE("x0", "um", cornerOf(m, m.lo_um[0])),
    FILIFORM_VALUE("y0", "um", cornerOf(m, m.lo_um[1])),
    FILIFORM_VALUE("z0", "um", cornerOf(m, m.lo_um[2])),
    FILIFORM_VALUE("x1", "um", cornerOf(m, m.hi_um[0])),
    FILIFORM_VALUE("y1", "um", cornerOf(m, m.hi_um[1])),
    FILIFORM_VALUE("z1", "um", cornerOf(m, m.hi_um[2])),
    FILIFORM_VALUE("extent_1", "um", mostOf(m.extents_um[0])),
    FILIFORM_VALUE("extent_2", "um", mostOf(m.extents_um[1])),
    FILIFORM_VALUE("extent_3", "um", mostOf(m.extents_um[2])),
    FILIFORM_VALUE("soma_link_length", "um", m.soma_link_um),
    FILIFORM_COUNT(zero_segments),
    FILIFORM_COUNT(unknown_radii),
    {"soma_samples", "",
     [](const Measures&, const SomaShape* s) { return s == nullptr ? kNoMeasure : static_cast<double>(s->samples); },
     true},
    FILIFORM_SOMA("soma_radius", "um", s->radius_um),
    FILIFORM_SOMA("soma_area", "um2", s->area_um2),
    FILIFORM_SOMA("soma_volume", "um3", s->volume_um3),
    FILIFORM_SOMA("soma_x", "um", s->samples == 0 ? kNoMeasure : s->centre_um[0]),
    FILIFORM_SOMA("soma_y", "um", s->samples == 0 ? kNoMeasure : s->centre_um[1]),
    FILIFORM_SOMA("soma_z", "um", s->samples == 0 ? kNoMeasure : s->centre_um[2]),
};

#undef FILIFORM_COUNT
#undef FILIFORM_VALUE
#undef FILIFORM_SOMA

}  // namespace

void MeasureSum::add(const MeasureSum& other) {
  sum += other.sum;
  most = std::max(most, other.most);
  count += other.count;
}

void Measures::add(const Measures& o) {
  cells += o.cells;
  neurites += o.neurites;
  sections += o.sections;
  segments += o.segments;
  bifurcations += o.bifurcations;
  forks += o.forks;
  tips += o.tips;
  loops += o.loops;
  zero_segments += o.zero_segments;
  unknown_radii += o.unknown_radii;
  length_um += o.length_um;
  area_um2 += o.area_um2;
  volume_um3 += o.volume_um3;
  soma_link_um += o.soma_link_um;
  for (MeasureSum Measures::*sum :
       {&Measures::section_length_um, &Measures::section_radial_um, &Measures::tip_path_um, &Measures::tip_radial_um,
        &Measures::branch_order, &Measures::strahler_order, &Measures::asymmetry, &Measures::asymmetry_uylings,
        &Measures::remote_angle_rad, &Measures::local_angle_rad, &Measures::sibling_ratio, &Measures::diameter_power,
        &Measures::tortuosity, &Measures::taper})
    (this->*sum).add(o.*sum);
  for (std::size_t axis = 0; axis < 3; ++axis) extents_um[axis].add(o.extents_um[axis]);
  lo_um = lo_um.cwiseMin(o.lo_um);
  hi_um = hi_um.cwiseMax(o.hi_um);
  addBins(sholl, o.sholl);
  addBins(sholl_by_ends, o.sholl_by_ends);
}

std::span<const Feature> features() { return kFeatures; }

std::string titleOf(const Feature& feature) {
  std::string title(feature.name);
  if (!feature.unit.empty()) (title += '_') += feature.unit;
  return title;
}

const Feature* findFeature(std::string_view name) {
  const auto* found = std::find_if(std::begin(kFeatures), std::end(kFeatures), [name](const Feature& feature) {
    return feature.name == name || titleOf(feature) == name;
  });
  return found == std::end(kFeatures) ? nullptr : found;
}

}  // namespace filiform
