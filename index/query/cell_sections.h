// CellSections: the sections of a cell, numbered as SONATA's `afferent_section_id` and NEURON number them, and places
// on them.
//
// A section is a chain of samples without forks, of one type, whose ids follow each other. SONATA's developer guide
// ("SWC Format additional requirements") gives the soma the number 0, then numbers the sections by type (axon, basal,
// apical), and those of a type in the order in which they begin in the file. NEURON's Import3d creates the same
// sections in the same order; where SONATA's guide is silent, the rules here are those of Import3d of NEURON 8.2:
// - A section begins with the last sample of its parent. One that a soma holds by a wire begins with its own first
//   sample: on a soma of one sample or a sphere of three, inside a soma of several, or where the soma forks.
// - A branch at the first sample of such a section, or at a root that is no soma, begins at the beginning of its
// parent.
// - A section of one point, or of two equal points, is left out; its children hang on its parent.
//
//   const CellPaths paths(readCell(*set, 0, true));
//   const CellSections sections(paths);
//   const auto [section, pos] = sections.of(paths.at(7));
#pragma once

#include "index/query/cell_paths.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace filiform {

struct SectionPlace {
  std::uint32_t section = 0;  // number
  double pos = 0;             // 0 the section's beginning .. 1 its end, along its length
};

// Thread rule: immutable once made.
class CellSections {
 public:
  // `cell` must have types and radii, and must outlive this object. Throws UsageError for a cell with loops, which has
  // no sections. A further root of the cell begins a section of its own. O(samples).
  explicit CellSections(const CellPaths& cell);

  std::uint32_t size() const { return static_cast<std::uint32_t>(by_number_.size()); }
  // A place on a wire is at the beginning of the section that the wire holds. A soma of one sample, or a sphere of
  // three, has pos 0.5. O(1).
  SectionPlace of(const CellPlace& place) const;
  // The place at `pos` (0 to 1) of a section; nullopt if there is no such section. O(samples of the section).
  std::optional<CellPlace> at(std::uint32_t section, double pos) const;

 private:
  struct Section {
    std::uint32_t begin = 0, end = 0;  // in order_: own samples
    std::uint32_t parent = kNoParent;  // index in order_ of the sample on which it hangs
    double parent_pos = 1;             // where on the parent's section
    bool is_wired = false;             // its length does not count from the parent's sample
    bool is_ball = false;
    bool is_left_out = false;
    std::uint32_t number = 0;
    double length_um = 0;
  };
  std::uint32_t parentOf(std::uint32_t index) const;
  double distance_um(std::uint32_t a, std::uint32_t b) const;
  std::uint16_t typeOf(std::uint32_t index) const { return cell_.graph().types[order_[index]]; }
  void order();
  void cut();
  void hang(std::uint32_t section);
  void measure();
  SectionPlace endOf(const Section& section, double pos) const;

  const CellPaths& cell_;
  std::vector<std::uint32_t> order_;       // ranks by id
  std::vector<std::uint32_t> index_;       // in order_, by rank
  std::vector<std::uint32_t> soma_below_;  // by index: children of type soma of a sample of type soma
  std::vector<bool> at_beginning_;         // by index: begins at the beginning of its parent
  bool is_sphere_ = false;                 // the first three samples
  std::vector<Section> sections_;          // in the order of the file
  std::vector<std::uint32_t> section_of_;  // by index
  std::vector<double> along_um_;           // by index: from the section's beginning
  std::vector<std::uint32_t> by_number_;
};

}  // namespace filiform
