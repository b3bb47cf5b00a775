// The literal transcription of the paper's solvers (Raya et al. 2011, 3.1 and 3.3, as DESIGN 5.1 and 5.2 read them):
// recursion and sets over a whole graph in memory, without bounds. Oracle of the tests and baseline of the benchmark;
// shares nothing with the product's solvers but closestPoint().
#pragma once

#include "index/closest_point.h"
#include "index/tile.h"
#include "solver/proxy_solver.h"

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <vector>

namespace filiform::test {

class WholeGraph {
 public:
  struct Node {
    NodeId id;
    Vector3d p_W;
    std::vector<std::uint32_t> incident;  // segments, in the order of identity
  };
  struct Segment {
    SegmentId id;
    std::uint32_t child, parent;
  };

  WholeGraph(std::span<const StoredSegment> segments, const Grid& grid);

  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<Segment>& segments() const { return segments_; }  // in the order of identity
  std::uint32_t node(NodeId id) const { return node_numbers_.at(id); }
  std::uint32_t segment(SegmentId id) const { return segment_numbers_.at(id); }

 private:
  std::vector<Node> nodes_;
  std::vector<Segment> segments_;
  std::map<NodeId, std::uint32_t> node_numbers_;
  std::map<SegmentId, std::uint32_t> segment_numbers_;
};

class PaperOracle {
 public:
  // The method is basic or force; the graph must outlive the oracle.
  PaperOracle(const WholeGraph& graph, SolverMethod method, const SolverParameters& parameters)
      : graph_(graph), force_(method == SolverMethod::force), parameters_(parameters) {}

  const ProxyPlace& place() const { return place_; }  // without a tile
  void setPlace(const ProxyPlace& place) { place_ = place; }
  // Returns the number of segments tested.
  std::uint32_t advance(const Vector3d& h_W);

 private:
  void visitSegment(std::uint32_t segment, std::int64_t entered, double d_sub2);
  void visitNode(std::uint32_t node, double d_sub2);

  const WholeGraph& graph_;
  bool force_;
  SolverParameters parameters_;
  ProxyPlace place_;
  Vector3d h_W_ = Vector3d::Zero();
  double best2_ = 0;
  std::set<std::uint32_t> seen_segments_, seen_nodes_;
};

}  // namespace filiform::test
