#include "index/tile/internal/simplify.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace filiform {
namespace {

constexpr std::uint32_t kNone = UINT32_MAX;
// Rounds up by more than the error of the distances below.
constexpr double kRoundUp = 1 + 1e-12;

// The graph's segments by node.
struct Incidence {
  std::vector<std::uint32_t> begin, list;

  Incidence(const std::vector<NeuriteSegment>& segments, std::size_t nodes) : begin(nodes + 1, 0) {
    for (const NeuriteSegment& s : segments) {
      if (s.child == s.parent) continue;
      ++begin[s.child + 1];
      ++begin[s.parent + 1];
    }
    for (std::size_t i = 1; i <= nodes; ++i) begin[i] += begin[i - 1];
    list.resize(begin.back());
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for (std::uint32_t s = 0; s < segments.size(); ++s) {
      if (segments[s].child == segments[s].parent) continue;
      list[next[segments[s].child]++] = s;
      list[next[segments[s].parent]++] = s;
    }
  }
  std::span<const std::uint32_t> at(std::uint32_t node) const {
    return {list.data() + begin[node], list.data() + begin[node + 1]};
  }
};

struct Run {
  std::span<const std::uint32_t> nodes, segments;  // one node more than segments; a loop ends at its first node
  bool downwards;                                  // true: from parent to child
};

// The state of one graph during simplification.
class Simplifier {
 public:
  Simplifier(const NeuriteGraph& graph, const Grid& grid)
      : graph_(graph),
        nodes_(graph.nodes),
        gone_(graph.segments.size(), 0),
        degree_(graph.nodes.size(), 0),
        open_(graph.nodes.size(), 0),
        incidence_(graph.segments, graph.nodes.size()) {
    at_.reserve(nodes_.size());
    absorbed_um_.reserve(nodes_.size());
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
      const NeuriteNode& node = nodes_[n];
      at_.push_back(grid.toWorld(node.p));
      absorbed_um_.push_back(node.absorbed_um);
      degree_[n] = static_cast<std::uint32_t>(incidence_.at(n).size());
      open_[n] = node.full == 0 || node.seen < node.full;
    }
  }

  // Removes twigs that lie within the tolerance of the node that carries them. The node then represents them.
  void prune(double tolerance_um) {
    std::vector<std::uint32_t> tips;
    for (std::uint32_t n = 0; n < nodes_.size(); ++n)
      if (degree_[n] == 1 && !open(n)) tips.push_back(n);
    std::vector<std::uint32_t> way;
    for (std::size_t i = 0; i < tips.size(); ++i) {
      way.clear();
      std::uint32_t n = tips[i];
      if (degree_[n] != 1) continue;
      do {
        way.push_back(otherThan(n, way.empty() ? kNone : way.back()));
        n = end(way.back(), n);
      } while (degree_[n] == 2 && !open(n));
      // A whole connected piece is not a twig: it must stay.
      if (degree_[n] < 2) continue;
      double reach = absorbed_um_[n];
      std::uint32_t v = tips[i];
      for (const std::uint32_t s : way) {
        const double stood = std::max(absorbed_um_[v], graph_.segments[s].error_um);
        reach = std::max(reach, ((at_[v] - at_[n]).norm() + stood) * kRoundUp);
        v = end(s, v);
      }
      if (reach > tolerance_um) continue;
      absorbed_um_[n] = reach;
      v = tips[i];
      for (const std::uint32_t s : way) {
        gone_[s] = 1;
        --degree_[v];
        v = end(s, v);
        --degree_[v];
      }
      if (degree_[n] == 1 && !open(n)) tips.push_back(n);
    }
  }

  // Finds the runs and the tolerance at which each inner node is removed. Tolerances below least_um need not be exact.
  void measure(double least_um) {
    runs_.clear();
    importance_.assign(nodes_.size(), 0);
    walked_ = gone_;
    // Every segment is in one run. A run has one node more than segments.
    run_segments_.clear();
    run_segments_.reserve(graph_.segments.size());
    run_nodes_.clear();
    run_nodes_.reserve(2 * graph_.segments.size());
    for (std::uint32_t n = 0; n < nodes_.size(); ++n)
      if (degree_[n] > 0 && (degree_[n] != 2 || open(n)))
        for (const std::uint32_t s : incidence_.at(n))
          if (!walked_[s]) trace(n, s);
    for (std::uint32_t n = 0; n < nodes_.size(); ++n)  // the rest are loops; each starts at its first node
      for (const std::uint32_t s : incidence_.at(n))
        if (!walked_[s]) trace(n, s);
    for (const Run& run : runs_) weigh(run, least_um);
  }

  // Number of segments that remain at this tolerance; also by cell, if asked.
  std::size_t count(double tolerance_um, std::vector<std::size_t>* by_share = nullptr) const {
    std::size_t all = 0;
    const auto add = [&](std::uint32_t node, std::size_t n) {
      all += n;
      if (by_share != nullptr) (*by_share)[shareOf(nodes_[node].id.cell)] += n;
    };
    for (const Run& run : runs_) {
      if (dropped(run.nodes[0])) continue;
      std::size_t n = 1;
      for (std::size_t i = 1; i + 1 < run.nodes.size(); ++i) n += importance_[run.nodes[i]] > tolerance_um;
      add(run.nodes[0], n);
    }
    for (const NeuriteSegment& s : graph_.segments)
      if (s.child == s.parent && !dropped(s.child)) add(s.child, 1);
    return all;
  }

  // The smallest tolerance of at least `least_um` that leaves at most `most` segments; infinite if there is none.
  double toleranceFor(std::size_t most, double least_um) const {
    std::size_t fixed = 0;
    std::vector<double> above;
    for (const Run& run : runs_) {
      if (dropped(run.nodes[0])) continue;
      ++fixed;
      for (std::size_t i = 1; i + 1 < run.nodes.size(); ++i)
        if (importance_[run.nodes[i]] > least_um) above.push_back(importance_[run.nodes[i]]);
    }
    for (const NeuriteSegment& s : graph_.segments) fixed += s.child == s.parent && !dropped(s.child);
    if (fixed + above.size() <= most) return least_um;
    if (fixed > most) return std::numeric_limits<double>::infinity();
    const auto nth = above.begin() + static_cast<std::ptrdiff_t>(most - fixed);
    std::nth_element(above.begin(), nth, above.end(), std::greater<>());
    return *nth;
  }

  // Removes whole cells, shortest first, until at most `most` segments remain; the longest cell stays.
  void dropCells(std::size_t most, double tolerance_um) {
    const std::vector<NeuriteShare>& shares = graph_.shares;
    dropped_.assign(shares.size(), false);
    std::vector<std::size_t> by_share(shares.size(), 0);
    std::size_t left = count(tolerance_um, &by_share);
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < shares.size(); ++i)
      if (by_share[i] > 0) order.push_back(i);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return shares[a].length_um != shares[b].length_um ? shares[a].length_um < shares[b].length_um : a < b;
    });
    for (std::size_t i = 0; i + 1 < order.size() && left > most; ++i) {
      dropped_[order[i]] = true;
      left -= by_share[order[i]];
    }
  }

  NeuriteGraph result(double tolerance_um) {
    NeuriteGraph out;
    out.dropped = graph_.dropped;
    out.dropped_um = graph_.dropped_um;
    for (std::size_t i = 0; i < graph_.shares.size(); ++i) {
      const NeuriteShare& share = graph_.shares[i];
      if (!dropped_.empty() && dropped_[i]) {
        out.dropped += share.segments;
        out.dropped_um += share.length_um;
      } else {
        out.shares.push_back(share);
      }
    }
    for (const Run& run : runs_)
      if (!dropped(run.nodes[0])) shorten(run, tolerance_um, out.segments);
    for (const NeuriteSegment& s : graph_.segments)
      if (s.child == s.parent && !dropped(s.child)) out.segments.push_back(s);

    std::vector<bool> used(nodes_.size(), false);
    for (const NeuriteSegment& s : out.segments) used[s.child] = used[s.parent] = true;
    for (const NeuriteSegment& s : loops_) {  // if no segment remains, keep the node as an isolated node
      if (used[s.child]) continue;
      used[s.child] = true;
      out.segments.push_back(s);
    }
    std::vector<std::uint32_t> number(nodes_.size(), kNone);
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
      // A node without a segment is kept only if more of its segments are still to come.
      if (!used[n] && !(nodes_[n].full > nodes_[n].seen && !dropped(n))) continue;
      number[n] = static_cast<std::uint32_t>(out.nodes.size());
      out.nodes.push_back(nodes_[n]);
      out.nodes.back().absorbed_um = absorbed_um_[n];
    }
    for (NeuriteSegment& s : out.segments) {
      s.child = number[s.child];
      s.parent = number[s.parent];
    }
    return out;
  }

 private:
  bool open(std::uint32_t n) const { return open_[n] != 0; }
  std::uint32_t end(std::uint32_t s, std::uint32_t from) const {
    return graph_.segments[s].child == from ? graph_.segments[s].parent : graph_.segments[s].child;
  }
  std::uint32_t otherThan(std::uint32_t n, std::uint32_t segment) const {
    for (const std::uint32_t s : incidence_.at(n))
      if (s != segment && !gone_[s]) return s;
    return kNone;
  }
  std::size_t shareOf(std::uint32_t cell) const {
    return static_cast<std::size_t>(
        std::lower_bound(graph_.shares.begin(), graph_.shares.end(), cell,
                         [](const NeuriteShare& s, std::uint32_t c) { return s.cell < c; }) -
        graph_.shares.begin());
  }
  bool dropped(std::uint32_t n) const { return !dropped_.empty() && dropped_[shareOf(nodes_[n].id.cell)]; }

  void trace(std::uint32_t from, std::uint32_t s) {
    const std::size_t first_node = run_nodes_.size(), first_segment = run_segments_.size();
    const bool downwards = graph_.segments[s].parent == from;
    run_nodes_.push_back(from);
    std::uint32_t n = from;
    do {
      walked_[s] = 1;
      run_segments_.push_back(s);
      n = end(s, n);
      run_nodes_.push_back(n);
      if (n == from || degree_[n] != 2 || open(n)) break;
      s = otherThan(n, s);
    } while (!walked_[s]);
    runs_.push_back({{run_nodes_.data() + first_node, run_nodes_.size() - first_node},
                     {run_segments_.data() + first_segment, run_segments_.size() - first_segment},
                     downwards});
  }

  // Ramer, Douglas, Peucker: a node is kept below the tolerance computed here, which never exceeds that of the
  // enclosing split. Distances are to the segment, not to its line. What a node and its segments already represent is
  // added.
  void weigh(const Run& run, double least_um) {
    if (run.nodes.size() < 3) return;
    std::vector<Part>& parts = parts_;
    parts.assign(1, {0, run.nodes.size() - 1, std::numeric_limits<double>::infinity()});
    while (!parts.empty()) {
      const Part part = parts.back();
      parts.pop_back();
      if (part.end - part.begin < 2) continue;
      const Vector3d& a = at_[run.nodes[part.begin]];
      const Vector3d way = at_[run.nodes[part.end]] - a;
      const double squared = way.squaredNorm();
      double worst = -1;
      std::size_t split = part.begin + 1;
      for (std::size_t i = part.begin + 1; i < part.end; ++i) {
        const Vector3d d = at_[run.nodes[i]] - a;
        const double t = squared > 0 ? std::clamp(d.dot(way) / squared, 0.0, 1.0) : 0.0;
        const double stood = std::max({absorbed_um_[run.nodes[i]], graph_.segments[run.segments[i - 1]].error_um,
                                       graph_.segments[run.segments[i]].error_um});
        const double key = (d - t * way).norm() + stood;
        if (key > worst) {
          worst = key;
          split = i;
        }
      }
      const double importance = std::min(worst * kRoundUp, part.most);
      if (importance <= least_um) continue;
      importance_[run.nodes[split]] = importance;
      parts.push_back({part.begin, split, importance});
      parts.push_back({split, part.end, importance});
    }
  }

  void shorten(const Run& run, double tolerance_um, std::vector<NeuriteSegment>& out) {
    std::size_t begin = 0;
    for (std::size_t i = 1; i < run.nodes.size(); ++i) {
      const bool last = i + 1 == run.nodes.size();
      if (!last && !(importance_[run.nodes[i]] > tolerance_um)) continue;
      NeuriteSegment s;
      s.child = run.nodes[run.downwards ? i : begin];
      s.parent = run.nodes[run.downwards ? begin : i];
      s.type = graph_.segments[run.segments[run.downwards ? i - 1 : begin]].type;
      const Vector3d a = at_[run.nodes[begin]], way = at_[run.nodes[i]] - a;
      double length = 0, radius = 0;
      for (std::size_t k = begin; k < i; ++k) {
        const NeuriteSegment& old = graph_.segments[run.segments[k]];
        s.error_um = std::max(s.error_um, old.error_um);
        const double one = (at_[run.nodes[k + 1]] - at_[run.nodes[k]]).norm() + 1e-9;
        if (!std::isnan(old.radius_um)) {
          length += one;
          radius += one * static_cast<double>(old.radius_um);
        }
      }
      if (i > begin + 1) {
        const double squared = way.squaredNorm();
        for (std::size_t k = begin + 1; k < i; ++k) {
          const Vector3d d = at_[run.nodes[k]] - a;
          const double t = squared > 0 ? std::clamp(d.dot(way) / squared, 0.0, 1.0) : 0.0;
          const double stood = std::max({absorbed_um_[run.nodes[k]], graph_.segments[run.segments[k - 1]].error_um,
                                         graph_.segments[run.segments[k]].error_um});
          s.error_um = std::max(s.error_um, ((d - t * way).norm() + stood) * kRoundUp);
        }
      }
      s.radius_um = length > 0 ? static_cast<float>(radius / length) : std::numeric_limits<float>::quiet_NaN();
      if (s.child == s.parent) {
        // A loop within the tolerance of its first node, which then represents it.
        absorbed_um_[s.child] = std::max(absorbed_um_[s.child], s.error_um);
        loops_.push_back({s.child, s.child, 0, s.radius_um, s.type});
        continue;  // end of the run
      }
      out.push_back(s);
      begin = i;
    }
  }

  struct Part {
    std::size_t begin, end;
    double most;
  };

  const NeuriteGraph& graph_;
  const std::vector<NeuriteNode>& nodes_;
  std::vector<Vector3d> at_;
  std::vector<double> absorbed_um_;
  std::vector<std::uint8_t> gone_;  // segments
  std::vector<std::uint32_t> degree_;
  std::vector<std::uint8_t> open_;  // nodes with more segments to come, or where neurites leave the graph
  Incidence incidence_;
  std::vector<Run> runs_;
  std::vector<std::uint32_t> run_nodes_, run_segments_;
  std::vector<std::uint8_t> walked_;
  std::vector<double> importance_;
  std::vector<Part> parts_;
  std::vector<NeuriteSegment> loops_;
  std::vector<bool> dropped_;  // by share; empty: none was dropped
};

bool isOpen(const NeuriteNode& n) { return n.full == 0 || n.seen < n.full; }

}  // namespace

NeuriteGraph neuritesOf(const Tile& tile, const TileAppearance& appearance, const Grid& grid) {
  NeuriteGraph graph;
  const GridBox block_box = tile.key().box();
  std::vector<std::uint32_t> seen(tile.node_count(), 0), number(tile.node_count(), kNone);
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    if (!tile.owned(s)) continue;
    ++seen[tile.child(s)];
    if (!tile.isolated(s)) ++seen[tile.parent(s)];
  }
  graph.nodes.reserve(tile.node_count());
  for (std::uint32_t n = 0; n < tile.node_count(); ++n) {
    const GridPoint p = tile.gridPoint(n);
    // Equals isHome(), but faster.
    const bool home = !tile.isLong() && (p.array() >= block_box.lo.array() && p.array() <= block_box.hi.array()).all();
    if (seen[n] == 0 && !home) continue;
    number[n] = static_cast<std::uint32_t>(graph.nodes.size());
    const auto full = home ? static_cast<std::uint32_t>(tile.incident(n).size()) : 0;
    graph.nodes.push_back({tile.nodeId(n), p, full, seen[n], 0});
  }
  graph.segments.reserve(tile.owned_count());
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    if (!tile.owned(s)) continue;
    const std::uint32_t cell = tile.segmentId(s).cell;
    graph.segments.push_back(
        {number[tile.child(s)], number[tile.parent(s)], 0, appearance.radii_um[s], appearance.types[s]});
    if (graph.shares.empty() || graph.shares.back().cell != cell) graph.shares.push_back({cell});
    ++graph.shares.back().segments;
    const GridPoint way = tile.gridPoint(tile.child(s)) - tile.gridPoint(tile.parent(s));
    graph.shares.back().length_um += way.cast<double>().norm() * grid.quantum_um();
  }
  return graph;
}

NeuriteGraph join(std::vector<NeuriteGraph> graphs) {
  if (graphs.size() == 1) return std::move(graphs.front());
  NeuriteGraph out;
  std::size_t nodes = 0, segments = 0;
  for (const NeuriteGraph& g : graphs) {
    nodes += g.nodes.size();
    segments += g.segments.size();
  }
  out.nodes.reserve(nodes);
  out.segments.reserve(segments);

  // Only open nodes can be in another graph too.
  struct Shared {
    std::uint64_t key;
    std::uint32_t graph, node;
    bool operator<(const Shared& other) const { return key != other.key ? key < other.key : graph < other.graph; }
  };
  std::vector<Shared> shared;
  for (std::uint32_t g = 0; g < graphs.size(); ++g)
    for (std::uint32_t n = 0; n < graphs[g].nodes.size(); ++n)
      if (isOpen(graphs[g].nodes[n])) shared.push_back({graphs[g].nodes[n].id.key(), g, n});
  std::sort(shared.begin(), shared.end());
  std::vector<std::vector<std::uint32_t>> number(graphs.size());
  for (std::size_t g = 0; g < graphs.size(); ++g) number[g].assign(graphs[g].nodes.size(), kNone);
  for (std::size_t i = 0; i < shared.size();) {
    const auto at = static_cast<std::uint32_t>(out.nodes.size());
    out.nodes.push_back(graphs[shared[i].graph].nodes[shared[i].node]);
    NeuriteNode& node = out.nodes.back();
    number[shared[i].graph][shared[i].node] = at;
    for (const std::uint64_t key = shared[i].key; ++i < shared.size() && shared[i].key == key;) {
      const NeuriteNode& other = graphs[shared[i].graph].nodes[shared[i].node];
      node.full = std::max(node.full, other.full);
      node.seen += other.seen;
      node.absorbed_um = std::max(node.absorbed_um, other.absorbed_um);
      number[shared[i].graph][shared[i].node] = at;
    }
  }
  for (std::size_t g = 0; g < graphs.size(); ++g) {
    for (std::uint32_t n = 0; n < graphs[g].nodes.size(); ++n) {
      if (number[g][n] != kNone) continue;
      number[g][n] = static_cast<std::uint32_t>(out.nodes.size());
      out.nodes.push_back(graphs[g].nodes[n]);
    }
    for (NeuriteSegment s : graphs[g].segments) {
      s.child = number[g][s.child];
      s.parent = number[g][s.parent];
      out.segments.push_back(s);
    }
    out.shares.insert(out.shares.end(), graphs[g].shares.begin(), graphs[g].shares.end());
    out.dropped += graphs[g].dropped;
    out.dropped_um += graphs[g].dropped_um;
    graphs[g] = {};
  }
  // Stable, so that the sums of lengths are the same with every library.
  std::stable_sort(out.shares.begin(), out.shares.end(),
                   [](const NeuriteShare& a, const NeuriteShare& b) { return a.cell < b.cell; });
  std::size_t last = 0;
  for (std::size_t i = 1; i < out.shares.size(); ++i) {
    if (out.shares[i].cell != out.shares[last].cell) {
      out.shares[++last] = out.shares[i];
      continue;
    }
    out.shares[last].segments += out.shares[i].segments;
    out.shares[last].length_um += out.shares[i].length_um;
  }
  if (!out.shares.empty()) out.shares.resize(last + 1);
  return out;
}

NeuriteGraph simplify(const NeuriteGraph& graph, const Grid& grid, const SimplifyOptions& options) {
  Simplifier work(graph, grid);
  work.prune(options.tolerance_um);
  work.measure(options.tolerance_um);
  double tolerance = work.toleranceFor(options.most_segments, options.tolerance_um);
  if (tolerance > options.most_tolerance_um) {
    tolerance = options.most_tolerance_um;
    work.prune(tolerance);
    work.measure(tolerance);
    if (work.count(tolerance) > options.most_segments) work.dropCells(options.most_segments, tolerance);
    // One cell exceeds the limit alone: increase the tolerance.
    for (int i = 0; i < 24 && work.count(tolerance) > options.most_segments; ++i) {
      tolerance *= 2;
      work.prune(tolerance);
      work.measure(tolerance);
    }
  }
  return work.result(tolerance);
}

double errorOf(const NeuriteGraph& graph) {
  double error = 0;
  for (const NeuriteSegment& s : graph.segments) error = std::max(error, s.error_um);
  for (const NeuriteNode& n : graph.nodes) error = std::max(error, n.absorbed_um);
  return error;
}

std::vector<StoredSegment> numbered(const NeuriteGraph& given, TileAppearance& appearance) {
  // By id, so that the numbers do not depend on how the graph was assembled.
  std::vector<std::uint32_t> order(given.nodes.size()), rank(given.nodes.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return given.nodes[a].id.key() < given.nodes[b].id.key(); });
  NeuriteGraph graph;
  graph.nodes.reserve(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    rank[order[i]] = i;
    graph.nodes.push_back(given.nodes[order[i]]);
  }
  graph.segments = given.segments;
  for (NeuriteSegment& s : graph.segments) {
    s.child = rank[s.child];
    s.parent = rank[s.parent];
  }
  const auto count = static_cast<std::uint32_t>(graph.nodes.size());
  std::vector<std::uint32_t> below_begin(count + 1, 0), below(graph.segments.size());
  std::vector<bool> is_child(count, false);
  for (const NeuriteSegment& s : graph.segments) {
    ++below_begin[s.parent + 1];
    is_child[s.child] = true;
  }
  for (std::size_t i = 1; i < below_begin.size(); ++i) below_begin[i] += below_begin[i - 1];
  std::vector<std::uint32_t> next(below_begin.begin(), below_begin.end() - 1);
  for (std::uint32_t s = 0; s < graph.segments.size(); ++s) below[next[graph.segments[s].parent]++] = s;

  std::vector<StoredSegment> out;
  out.reserve(graph.segments.size());
  appearance.radii_um.clear();
  appearance.types.clear();
  next.assign(below_begin.begin(), below_begin.end() - 1);  // by node: its first segment not written yet
  std::vector<std::uint32_t> number(count, kNone), path;
  std::uint32_t cell = kNone, fresh = 0;
  const auto start = [&](std::uint32_t root) {
    if (graph.nodes[root].id.cell != cell) {
      cell = graph.nodes[root].id.cell;
      fresh = 0;
    }
    path.assign(1, root);
    while (!path.empty()) {
      const std::uint32_t parent = path.back();
      if (next[parent] == below_begin[parent + 1]) {
        path.pop_back();
        continue;
      }
      const NeuriteSegment& s = graph.segments[below[next[parent]++]];
      const bool alone = s.child == s.parent;
      if (!alone && number[parent] == kNone) number[parent] = fresh++;
      const std::uint32_t child_number = fresh++;
      const bool first = number[s.child] == kNone;
      if (first) number[s.child] = child_number;
      out.push_back({{cell, child_number},
                     child_number,
                     alone ? child_number : number[parent],
                     graph.nodes[s.child].p,
                     graph.nodes[s.parent].p,
                     true});
      appearance.radii_um.push_back(s.radius_um);
      appearance.types.push_back(s.type);
      if (first && !alone) path.push_back(s.child);
    }
  };
  for (std::uint32_t begin = 0, end = 0; begin < count; begin = end) {  // cell by cell
    while (end < count && graph.nodes[end].id.cell == graph.nodes[begin].id.cell) ++end;
    for (std::uint32_t n = begin; n < end; ++n)
      if (!is_child[n] && next[n] < below_begin[n + 1]) start(n);
    for (std::uint32_t n = begin; n < end; ++n)  // loops and isolated nodes
      while (next[n] < below_begin[n + 1]) start(n);
  }
  return out;
}

}  // namespace filiform
