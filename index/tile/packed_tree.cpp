#include "index/tile/packed_tree.h"

#include "index/errors.h"
#include "index/tile/internal/packed_boxes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cfloat>
#include <cmath>
#include <utility>

namespace filiform {
namespace {

using namespace internal::packed;

constexpr std::uint32_t kTopNodes = 16;

struct Path {
  Test test;
  Join join;
  bool eight;  // eight segments at once
};

#ifdef FILIFORM_AVX2
bool runsAvx2() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") && __builtin_cpu_supports("popcnt");
}
#endif

Path pathOf(const std::string& path) {
  if (path == "portable") return {testPortable, joinPortable, false};
#ifdef FILIFORM_AVX2
  if (path == "avx2" && runsAvx2()) return {testAvx2, joinAvx2, true};
#endif
  throw UsageError("the packed tree has no path \"" + path + "\" on this machine");
}

class PackedTree final : public TileEngine {
 public:
  PackedTree(std::shared_ptr<const Tile> tile, const Path& path)
      : tile_(std::move(tile)), path_(path), offsets_{tile_->narrowOffsets(), tile_->wordOffsets()} {
    build();
  }

  void search(const Vector3d& h_W, Candidates& best) const override;
  void collect(const Region& region, std::vector<std::uint32_t>& segments) const override;
  std::size_t bytes() const override { return sizeof *this + nodes_.size() * sizeof(Node); }

 private:
  friend class WideSearch;

  // Levels from the leaves up: a node of level 0 holds the boxes of eight runs, a node of level l those of eight nodes
  // of level l - 1. The last level is small enough to scan.
  struct Level {
    std::uint32_t begin, children;  // its first node; number of boxes in all its nodes

    std::uint32_t nodes() const { return (children + kWidth - 1) / kWidth; }
  };

  // A probe, in units and quanta, with the bounds of float's error.
  struct Query {
    Probe probe;
    std::array<float, 3> near;  // the probe, in quanta
    float per_quantum;          // units a quantum: a power of two
    float sift_margin;          // quanta
    double per_unit2;           // um^2 a squared unit

    // Converts a squared distance in um^2 to units for box tests, rounded up.
    float boxBound(double squared) const {
      const double bound = squared * per_unit2;
      return bound < 1e37 ? static_cast<float>(bound * (1 + 0x1p-19)) + FLT_MIN : kInfinity;
    }
    // Converts a bound of boxes to quanta, for segment distances computed in float.
    float siftBound(float box_bound) const {
      const float far = std::sqrt(box_bound) * per_quantum * (1 + 0x1p-16f) + sift_margin;
      return far * far;
    }
    // An upper bound, um^2, of what closestPoint() reports for a distance computed in float.
    double surely(float sifted) const {
      const double far = (std::sqrt(double{sifted}) * (1 + 0x1p-16) + double{sift_margin}) / double{per_quantum};
      return far * far / per_unit2;
    }
  };

  [[gnu::always_inline]] inline RunEnds endsOf(std::uint32_t run) const {
    const SegmentRun r = runs_[run];
    return {tile_->child(r.begin()), tile_->parent(r.begin()), r.count()};
  }

  void build();
  void searchAll(const Vector3d& h_W, Candidates& best) const;
  void searchRun(std::uint32_t run, const Vector3d& h_W, Candidates& best) const;
  void searchOrdered(const Query& query, const Vector3d& h_W, Candidates& best) const;
  void offer(std::uint32_t run, std::uint32_t i, const Vector3d& h_W, Candidates& best) const {
    const RunEnds ends = endsOf(run);
    const std::uint32_t child = ends.child + i, parent = i == 0 ? ends.parent : child - 1;
    best.offer(*tile_, tile_->runs()[run].begin() + i, tile_->position_W(child), tile_->position_W(parent), h_W);
  }
  unsigned present(std::uint32_t level, std::uint32_t node) const {
    const std::uint32_t left = levels_[level].children - kWidth * node;
    return left >= kWidth ? 0xff : (1u << left) - 1;
  }

  std::shared_ptr<const Tile> tile_;
  Path path_;
  Offsets offsets_;
  const SegmentRun* runs_ = nullptr;
  std::uint32_t level_count_ = 0;
  std::array<Level, 11> levels_{};  // enough for 8^10 runs
  std::vector<Node> nodes_;
  double unit_um_ = 1, size_um_ = 0;  // size: the tile's largest coordinate
  Vector3d origin_W_ = Vector3d::Zero();
};

void PackedTree::build() {
  const std::span<const SegmentRun> runs = tile_->runs();
  if (runs.empty()) return;
  runs_ = runs.data();
  std::uint32_t nodes = 0;
  for (auto children = static_cast<std::uint32_t>(runs.size());;) {
    const Level& level = levels_[level_count_++] = {nodes, children};
    nodes += children = level.nodes();
    if (children <= kTopNodes) break;
  }
  nodes_.resize(nodes, nothing());

  // One bit is reserved for the carry of rounding up.
  const int shift = tile_->offset_bits() <= 16 ? 0 : tile_->offset_bits() - 15;
  const std::uint64_t up = (std::uint64_t{1} << shift) - 1;
  [[maybe_unused]] RunEnds before{};
  for (std::uint32_t r = 0; r < runs.size(); ++r) {
    Node& node = nodes_[r / kWidth];
#ifdef FILIFORM_AVX2
    if (path_.eight && tile_->offset_bits() <= 16) {
      const RunEnds ends = endsOf(r);
      if (r % 2 == 1)
        boundAvx2(offsets_, before, ends, node, r % kWidth - 1);
      else if (r + 1 == runs.size())
        boundAvx2(offsets_, ends, ends, node, r % kWidth);
      before = ends;
      continue;
    }
#endif
    Tile::Offset lo, hi;
    tile_->bound(runs[r], lo, hi);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      node.lo[axis][r % kWidth] = static_cast<std::uint16_t>(lo[axis] >> shift);
      node.hi[axis][r % kWidth] = static_cast<std::uint16_t>((hi[axis] + up) >> shift);
    }
  }
  for (std::uint32_t level = 1; level < level_count_; ++level)
    for (std::uint32_t child = 0; child < levels_[level].children; ++child)
      path_.join(nodes_[levels_[level - 1].begin + child], nodes_[levels_[level].begin + child / kWidth],
                 child % kWidth);

  const Grid grid = tile_->grid();
  unit_um_ = std::ldexp(grid.quantum_um(), shift);
  origin_W_ = grid.toWorld(tile_->origin());
  size_um_ = origin_W_.cwiseAbs().maxCoeff() + unit_um_ * 65536.0;
}

void PackedTree::searchRun(std::uint32_t run, const Vector3d& h_W, Candidates& best) const {
  const SegmentRun r = tile_->runs()[run];
  const RunEnds ends = endsOf(run);
  Vector3d parent_W = tile_->position_W(ends.parent);
  for (std::uint32_t i = 0; i < r.count(); ++i) {
    const Vector3d child_W = tile_->position_W(ends.child + i);
    best.offer(*tile_, r.begin() + i, child_W, parent_W, h_W);
    parent_W = child_W;
  }
}

void PackedTree::searchAll(const Vector3d& h_W, Candidates& best) const {
  for (std::uint32_t run = 0; run < tile_->runs().size(); ++run) searchRun(run, h_W, best);
}

#ifdef FILIFORM_AVX2
// Finds one nearest segment. First goes down to the eight runs with the nearest box, for a nearly exact bound. Then
// lists all boxes within the bound, level by level. Boxes are appended without a branch, since an unpredictable branch
// costs more than the test of eight boxes. Segment distances are computed in float, eight at once; closestPoint()
// measures the few segments that may be nearest.
class WideSearch {
 public:
  FILIFORM_AVX2_CODE WideSearch(const PackedTree& tree, const PackedTree::Query& query, const Vector3d& h_W,
                                Candidates& best)
      : tree_(tree), query_(query), probe_(query.probe), h_W_(h_W), best_(best) {}

  FILIFORM_AVX2_CODE void run();

 private:
  static constexpr std::uint32_t kHits = 64;

  struct Hit {
    std::uint32_t run, segment;
    float squared;
  };

  // Searches boxes of nodes of a level, or of runs at level -1. Boxes much nearer than the bound come first, which
  // tightens the bound.
  FILIFORM_AVX2_CODE void visit(int level, BoxList& list) {
    if (level >= 0) return expand(level, list);
    BoxList near, far;
    list.split(bound_ * kMuchNearer, near);
    if (near.size > 0) siftAll(near);
    list.split(bound_, far);
    if (far.size > 0) siftAll(far);
  }
  FILIFORM_AVX2_CODE void expand(int level, const BoxList& nodes);
  FILIFORM_AVX2_CODE void siftAll(const BoxList& runs);
  void keep(const std::uint32_t* runs, unsigned lanes, const float* squared);
  void tighten(float squared) {
    least_ = squared;
    const double surely = query_.surely(squared);
    bound_ = std::min(bound_, query_.boxBound(best_.boundIf(surely)));
    kept_ = std::min(kept_, query_.siftBound(query_.boxBound(surely)));
  }

  static constexpr float kMuchNearer = 1.0f / 16;  // squared

  const PackedTree& tree_;
  const PackedTree::Query& query_;
  const WideProbe probe_;
  const Vector3d& h_W_;
  Candidates& best_;
  float bound_ = kInfinity;          // of boxes, units
  float kept_ = kInfinity;           // of segments, quanta: those that may be the nearest
  float least_ = kInfinity;          // smallest distance of a segment
  std::uint32_t done_ = UINT32_MAX;  // the node of level 0 searched first
  std::uint32_t hit_count_ = 0;
  std::array<Hit, kHits> hits_;
};

void WideSearch::run() {
  bound_ = query_.boxBound(best_.bound2());
  kept_ = query_.siftBound(query_.boxBound(best_.limit2()));
  const std::uint32_t top = tree_.level_count_ - 1, count = tree_.levels_[top].nodes();
  alignas(32) std::array<float, kTopNodes * kWidth> squared;
  const Node* nodes = &tree_.nodes_[tree_.levels_[top].begin];
  __m256 nearest = _mm256_set1_ps(kInfinity);
  for (std::uint32_t n = 0; n < count; ++n) {
    const __m256 d = probe_.squaredTo(nodes[n]);
    _mm256_store_ps(&squared[kWidth * n], d);
    if (n + 1 < count) nearest = _mm256_min_ps(nearest, d);
  }
  for (std::uint32_t i = tree_.levels_[top].children; i < kWidth * count; ++i) squared[i] = kInfinity;
  nearest = _mm256_min_ps(nearest, _mm256_load_ps(&squared[kWidth * (count - 1)]));
  const float first = least(nearest);
  if (!(first <= bound_)) return;
  std::uint32_t at = 0;
  for (unsigned mask = 0;; at += kWidth)
    if ((mask = within(_mm256_load_ps(&squared[at]), first)) != 0) {
      at += static_cast<std::uint32_t>(std::countr_zero(mask));
      break;
    }
  for (std::uint32_t level = top; level > 0; --level) {
    const __m256 d = probe_.squaredTo(tree_.nodes_[tree_.levels_[level - 1].begin + at]);
    const __m256i lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    const auto children = static_cast<std::int32_t>(tree_.levels_[level - 1].children - kWidth * at);
    const __m256 absent = _mm256_castsi256_ps(_mm256_cmpgt_epi32(lanes, _mm256_set1_epi32(children - 1)));
    const __m256 there = _mm256_blendv_ps(d, _mm256_set1_ps(kInfinity), absent);
    at = kWidth * at + static_cast<std::uint32_t>(std::countr_zero(within(there, least(there))));
  }
  done_ = at / kWidth;
  BoxList list;
  list.append(kWidth * done_, _mm256_setzero_ps(), tree_.present(0, done_));
  siftAll(list);

  list.size = 0;
  for (std::uint32_t n = 0; n < count; ++n) {
    const __m256 d = _mm256_load_ps(&squared[kWidth * n]);
    unsigned mask = within(d, bound_);
    if (top == 0 && n == done_) mask = 0;
    list.append(kWidth * n, d, mask);
    if (list.full()) {
      visit(static_cast<int>(top) - 1, list);
      list.size = 0;
    }
  }
  visit(static_cast<int>(top) - 1, list);

  for (std::uint32_t i = 0; i < hit_count_; ++i)
    if (hits_[i].squared <= kept_) tree_.offer(hits_[i].run, hits_[i].segment, h_W_, best_);
}

void WideSearch::expand(int level, const BoxList& nodes) {
  BoxList below;
  const auto l = static_cast<std::uint32_t>(level);
  const Node* at = &tree_.nodes_[tree_.levels_[l].begin];
  const std::uint32_t skipped = level == 0 ? done_ : UINT32_MAX;
  for (std::uint32_t i = 0; i < nodes.size; ++i) {
    const std::uint32_t node = nodes.at[i];
    const __m256 d = probe_.squaredTo(at[node]);
    const unsigned mask = within(d, bound_) & tree_.present(l, node);
    below.append(kWidth * node, d, node == skipped ? 0 : mask);
    if (below.full()) {
      visit(level - 1, below);
      below.size = 0;
    }
  }
  visit(level - 1, below);
}

void WideSearch::siftAll(const BoxList& runs) {
  alignas(32) std::array<std::array<float, kWidth>, kListBoxes / 2 + kWidth> squared;
  __m256 all = _mm256_set1_ps(kInfinity);
  for (std::uint32_t i = 0; i < runs.size; i += 2) {
    const RunEnds a = tree_.endsOf(runs.at[i]);
    RunEnds b = a;
    if (i + 1 < runs.size)
      b = tree_.endsOf(runs.at[i + 1]);
    else
      b.count = 0;
    const __m256 d = sift(tree_.offsets_, a, b, query_.near);
    _mm256_store_ps(squared[i / 2].data(), d);
    all = _mm256_min_ps(all, d);
  }
  if (const float nearest = least(all); nearest < least_) tighten(nearest);
  for (std::uint32_t i = 0; i < runs.size; i += 2)
    if (const unsigned mask = within(_mm256_load_ps(squared[i / 2].data()), kept_); mask != 0)
      keep(&runs.at[i], mask, squared[i / 2].data());
}

// Keeps the hits of two runs.
void WideSearch::keep(const std::uint32_t* runs, unsigned lanes, const float* squared) {
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto lane = static_cast<std::uint32_t>(std::countr_zero(lanes));
    if (!(squared[lane] < kInfinity)) continue;
    if (hit_count_ == kHits) {  // many equal distances: measure them
      for (const Hit& hit : hits_)
        if (hit.squared <= kept_) tree_.offer(hit.run, hit.segment, h_W_, best_);
      hit_count_ = 0;
    }
    hits_[hit_count_++] = {runs[lane / kRun], lane % kRun, squared[lane]};
  }
}
#endif

void PackedTree::search(const Vector3d& h_W, Candidates& best) const {
  if (level_count_ == 0) return;
  // In units. The margin covers four times the rounding to float, and the error of closestPoint().
  const Vector3d h = (h_W - origin_W_) / unit_um_;
  const double reach = h.cwiseAbs().maxCoeff();
  if (!(reach < 1e15)) return searchAll(h_W, best);
  constexpr double kUlps = 16 * std::numeric_limits<double>::epsilon();
  const double margin =
      std::ldexp(reach, -22) + kUlps * (size_um_ + h_W.cwiseAbs().maxCoeff()) / unit_um_ + std::ldexp(1.0, -40);
  const double per_quantum = unit_um_ / tile_->grid().quantum_um();
  Query query;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double at = h[static_cast<Eigen::Index>(axis)];
    query.probe.lo[axis] = static_cast<float>(at - margin);
    query.probe.hi[axis] = static_cast<float>(at + margin);
    query.near[axis] = static_cast<float>(at * per_quantum);
  }
  query.per_quantum = static_cast<float>(per_quantum);
  // A coordinate errs by at most the margin and half a unit, and so does a point on a segment.
  query.sift_margin = static_cast<float>((margin * per_quantum + std::ldexp(1.0, tile_->offset_bits() - 18)) * 8);
  query.per_unit2 = 1 / (unit_um_ * unit_um_);
#ifdef FILIFORM_AVX2
  const bool lean = offsets_.narrow != nullptr || offsets_.words != nullptr;
  if (path_.eight && lean && best.single() && reach < 0x1p24) return WideSearch(*this, query, h_W, best).run();
#endif
  searchOrdered(query, h_W, best);
}

// Searches with a queue, nearest boxes first.
void PackedTree::searchOrdered(const Query& query, const Vector3d& h_W, Candidates& best) const {
  struct Entry {
    float squared;
    std::uint32_t at;  // a node; at level kLeaf, a run
    std::uint32_t level;
  };
  constexpr std::uint32_t kLeaf = UINT32_MAX;
  std::array<Entry, (11 + kTopNodes) * kWidth> stack;
  std::uint32_t depth = 0;
  float bound = query.boxBound(best.bound2());
  const auto push = [&](std::uint32_t level, std::uint32_t at, std::uint32_t bottom) {
    alignas(32) std::array<float, kWidth> squared;
    unsigned within =
        path_.test(nodes_[levels_[level].begin + at], query.probe, bound, squared.data()) & present(level, at);
    for (; within != 0; within &= within - 1) {  // farthest first
      const auto i = static_cast<std::uint32_t>(std::countr_zero(within));
      std::uint32_t place = depth++;
      for (; place > bottom && stack[place - 1].squared < squared[i]; --place) stack[place] = stack[place - 1];
      stack[place] = {squared[i], kWidth * at + i, level == 0 ? kLeaf : level - 1};
    }
  };
  for (std::uint32_t at = 0; at < levels_[level_count_ - 1].nodes(); ++at) push(level_count_ - 1, at, 0);
  while (depth > 0) {
    const Entry top = stack[--depth];
    if (top.squared > bound) continue;
    if (top.level != kLeaf) {
      push(top.level, top.at, depth);
      continue;
    }
    searchRun(top.at, h_W, best);
    bound = query.boxBound(best.bound2());
  }
}

void PackedTree::collect(const Region& region, std::vector<std::uint32_t>& segments) const {
  if (level_count_ == 0) return;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> stack;
  for (std::uint32_t at = 0; at < levels_[level_count_ - 1].nodes(); ++at) stack.emplace_back(level_count_ - 1, at);
  while (!stack.empty()) {
    const auto [level, at] = stack.back();
    stack.pop_back();
    const Node& node = nodes_[levels_[level].begin + at];
    for (unsigned left = present(level, at); left != 0; left &= left - 1) {
      const auto i = static_cast<std::uint32_t>(std::countr_zero(left));
      const Vector3d lo(node.lo[0][i], node.lo[1][i], node.lo[2][i]), hi(node.hi[0][i], node.hi[1][i], node.hi[2][i]);
      if (!region.mayMeet({origin_W_ + unit_um_ * lo, origin_W_ + unit_um_ * hi})) continue;
      if (level > 0) {
        stack.emplace_back(level - 1, kWidth * at + i);
        continue;
      }
      const SegmentRun run = tile_->runs()[kWidth * at + i];
      for (std::uint32_t s = 0; s < run.count(); ++s) segments.push_back(run.begin() + s);
    }
  }
}

}  // namespace

std::vector<std::string> packedTreePaths() {
  std::vector<std::string> paths{"portable"};
#ifdef FILIFORM_AVX2
  if (runsAvx2()) paths.emplace_back("avx2");
#endif
  return paths;
}

std::unique_ptr<TileEngine> makePackedTree(std::shared_ptr<const Tile> tile, const std::string& path) {
  static const Path kFastest = pathOf(packedTreePaths().back());
  return std::make_unique<PackedTree>(std::move(tile), path.empty() ? kFastest : pathOf(path));
}

}  // namespace filiform
