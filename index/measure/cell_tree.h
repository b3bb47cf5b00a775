// CellTree: a cell as measures see it: its soma, and neurites cut into sections. MEASURES.md defines all words.
#pragma once

#include "index/cell/cell.h"
#include "index/query/cell_graph.h"

#include <array>
#include <cstdint>
#include <vector>

namespace filiform {

// What the samples of type 1 mean together. Thread rule: a value.
struct SomaShape {
  enum class Form : std::uint8_t {
    kNone,        // no sample of type 1; all sizes are 0
    kOne,         // one sample: a sphere
    kThreePoint,  // a root and its two children: a cylinder between the children, with the root's radius
    kContour,     // an outline: a sphere (index/cell/soma.h)
    kCylinders,   // all others: a chain of frusta, in the order of the samples
  };
  Form form = Form::kNone;
  std::uint32_t samples = 0;
  Vector3d centre_um = Vector3d::Zero();  // the first sample of type 1; of an outline the mean
  double radius_um = 0, area_um2 = 0, volume_um3 = 0;
};

// Thread rule: thread-compatible.
struct CellTree {
  static constexpr std::uint32_t kNone = UINT32_MAX;

  // An unbranched run. Its first point is that of the fork at which it begins, unless its first sample lies there.
  struct Section {
    std::uint32_t first = 0, count = 0;  // of points_um; at least one
    std::uint32_t parent = kNone;        // position in `sections`; kNone: the root section of its neurite
    std::uint32_t children = 0;
    std::uint32_t rank = 0;       // of its last sample
    bool begins_at_fork = false;  // the first point is a copy of the fork's
  };
  struct Neurite {
    std::uint32_t first = 0, count = 0;  // of `sections`
    std::uint32_t rank = 0;              // of its first sample
    std::uint16_t type = 0;              // of its first sample
    double soma_link_um = 0;             // from its first sample to the soma sample that is its parent; 0 without
  };
  // A link that closes a loop. It belongs to no section.
  struct Closing {
    std::uint32_t neurite = 0;
    std::array<std::uint32_t, 2> points{};  // of points_um
  };

  SomaShape soma;
  std::vector<Neurite> neurites;  // ascending by rank
  std::vector<Section> sections;  // depth first: a section, then all of its first child, then all of the next child
  std::vector<Vector3d> points_um;
  std::vector<double> radii_um;  // by point; NaN if unknown
  std::vector<Closing> closings;
};

// The samples of a cell as a tree. A cell with loops is cut into the forest that connect() finds. Requires radii and
// types. O(samples).
CellTree treeOf(const CellGraph& cell);
CellTree treeOf(const Cell& cell);

}  // namespace filiform
