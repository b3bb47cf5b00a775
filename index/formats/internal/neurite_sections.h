// NeuriteSections: builds the graph of a neuron from its soma and its sections, as H5 and Neurolucida files hold them.
//
// The soma becomes one sample, and each section without a parent is linked to it (soma_link.h), or to the section on
// which it begins (tree_joins.h). The soma is the first sample, so it is the root. The first point of a section is left
// out if it repeats the last point of the parent, or the point on which it begins.
#pragma once

#include "index/formats/internal/graph_builder.h"

#include <cstdint>
#include <span>
#include <vector>

namespace filiform::internal {

struct SectionPoint {
  Vector3d position;    // in the unit of the file
  double radius;        // NaN: unknown
  std::uint64_t place;  // from 1, unique in the file: the sample's id, and the line of records
};

// Thread rule: thread-compatible. Holds all points until finish().
class NeuriteSections {
 public:
  static constexpr std::uint32_t kNoSection = UINT32_MAX;

  // `graph` must outlive this object.
  NeuriteSections(GraphBuilder& graph, bool soma_links) : graph_(graph), soma_links_(soma_links) {}

  // Adds points of the soma, before or after the sections. Several contours count as one.
  void soma(std::span<const SectionPoint> contour);
  // Adds a section of at least one point; returns its number, from 0. `parent` is an earlier section or kNoSection.
  std::uint32_t section(std::uint32_t parent, std::uint16_t type, std::span<const SectionPoint> points);
  // Passes everything to the graph. Call it once. O(points).
  void finish();

 private:
  struct Section {
    std::uint32_t parent;
    std::uint16_t type;
    std::size_t begin, end;  // in points_
  };
  GraphBuilder& graph_;
  bool soma_links_;
  std::vector<SectionPoint> soma_, points_;
  std::vector<Section> sections_;
};

}  // namespace filiform::internal
