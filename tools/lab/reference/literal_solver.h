// A literal transcription of the paper's solvers (Raya et al. 2011, 3.1 and 3.3, read as in descent.h and
// force_based.h): recursion and hash sets over one whole graph in memory, without bounds, resuming or tiles. The solver
// benchmark compares with it, and it is the oracle of the solver tests. It is simple, not tuned. It shares only
// closestPoint() with the product's solvers. Thread-compatible.
#pragma once

#include "index/geometry/closest_point.h"
#include "index/tile/tile.h"
#include "solver/proxy/proxy_solver.h"

#include <cstdint>
#include <map>
#include <span>
#include <unordered_set>
#include <vector>

namespace filiform::tools {

class WholeGraph {
 public:
  struct Node {
    NodeId id;
    Vector3d p_W;
    std::vector<std::uint32_t> incident;  // segments, in the order of their ids
  };
  struct Segment {
    SegmentId id;
    std::uint32_t child, parent;
  };

  WholeGraph(std::span<const StoredSegment> segments, const Grid& grid);

  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<Segment>& segments() const { return segments_; }  // in the order of their ids
  std::uint32_t node(NodeId id) const { return node_numbers_.at(id); }
  std::uint32_t segment(SegmentId id) const { return segment_numbers_.at(id); }

 private:
  std::vector<Node> nodes_;
  std::vector<Segment> segments_;
  std::map<NodeId, std::uint32_t> node_numbers_;
  std::map<SegmentId, std::uint32_t> segment_numbers_;
};

class LiteralSolver {
 public:
  static bool knows(SolverMethod method) {
    return method == SolverMethod::basic || method == SolverMethod::force || method == SolverMethod::force_listing;
  }
  // Requires a method for which knows() is true. The graph must outlive the solver.
  LiteralSolver(const WholeGraph& graph, SolverMethod method, const SolverParameters& parameters)
      : graph_(graph), method_(method), parameters_(parameters) {}

  ProxyPlace place() const;  // has no tile
  void setPlace(const ProxyPlace& place);
  // Returns the number of segments tested.
  std::uint32_t advance(const Vector3d& h_W);

  const Vector3d& p_W() const { return p_W_; }

 private:
  void visitSegment(std::uint32_t segment, std::int64_t entered, double d_sub2);
  void visitNode(std::uint32_t node, double d_sub2);
  // Algorithms 3 and 2. `dist2` and the result: the squared distance of the best point so far.
  double listedSegment(std::uint32_t segment, std::int64_t entered, double dist2);
  double listedNode(std::uint32_t node, double dist2);
  void take(std::uint32_t segment, const ClosestPoint& q);

  const WholeGraph& graph_;
  SolverMethod method_;
  SolverParameters parameters_;
  std::uint32_t segment_ = 0;  // the place: on this segment at t_; at the child if t_ is 0, at the parent if it is 1
  double t_ = 0;
  Vector3d p_W_ = Vector3d::Zero();
  Vector3d h_W_ = Vector3d::Zero();
  double best2_ = 0;
  std::unordered_set<std::uint32_t> seen_segments_, seen_nodes_;
};

}  // namespace filiform::tools
