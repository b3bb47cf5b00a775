#include "index/tile/internal/packed_boxes.h"

#include <algorithm>
#include <bit>
#include <utility>

// Highway compiles this source once for each instruction set. The emulated one is for x86-64 without SSSE3 (before
// 2011): g++ below 12.3 miscompiles only multiplications of it that are not used here. SVE has vectors without a size.
#define HWY_BROKEN_EMU128 0
#define HWY_BROKEN_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "index/tile/internal/packed_boxes.cpp"
// clang-format off
#include <hwy/foreach_target.h>  // before highway.h

#include "index/tile/internal/packed_lanes.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace filiform::internal::packed::HWY_NAMESPACE {
namespace {

constexpr std::uint32_t kListBoxes = 64;

// Boxes to search: nodes of one level, or runs. A mask selects some of eight boxes, which are appended without a
// branch.
struct BoxList {
  std::uint32_t size = 0;
  std::uint32_t at[kListBoxes + kWidth];
  float squared[kListBoxes + kWidth];  // distance

  bool full() const { return size > kListBoxes - kWidth; }
  // Appends those of the boxes first, first + 1 ... whose bit is set.
  HWY_INLINE void append(std::uint32_t first, const Floats& distances, unsigned mask) {
    for (std::size_t p = 0; p < kParts; ++p)
      append(hn::Iota(TagU(), first + static_cast<std::uint32_t>(p * kLanes)), distances.part[p],
             mask >> (p * kLanes) & kPartMask);
  }
  HWY_INLINE void append(VecU boxes, VecF distances, unsigned mask) {
    hn::StoreU(selected(boxes, mask), TagU(), at + size);
    hn::StoreU(selected(distances, mask), TagF(), squared + size);
    size += ones(mask);
  }
  // Moves the boxes within the bound to `near`.
  HWY_INLINE void split(float bound, BoxList& near) {
    std::uint32_t left = 0;
    const VecF most = hn::Set(TagF(), bound);
    for (std::uint32_t i = 0; i < size; i += kLanes) {
      const VecU boxes = hn::LoadU(TagU(), at + i);
      const VecF distances = hn::LoadU(TagF(), squared + i);
      std::uint8_t bits[8] = {};
      hn::StoreMaskBits(TagF(), hn::Le(distances, most), bits);
      const unsigned there = size - i >= kLanes ? kPartMask : (1u << (size - i)) - 1, mask = bits[0] & there;
      near.append(boxes, distances, mask);
      const std::uint32_t all = std::exchange(size, left);
      append(boxes, distances, ~mask & there);
      left = std::exchange(size, all);
    }
    size = left;
  }
};

// Finds one nearest segment. First goes down to the eight runs with the nearest box, for a nearly exact bound. Then
// lists all boxes within the bound, level by level. Boxes are appended without a branch, since an unpredictable branch
// costs more than the test of eight boxes. Segment distances are computed in float, eight at once; closestPoint()
// measures the few segments that may be nearest.
class WideSearch {
 public:
  WideSearch(const Boxes& tree, const Query& query, const Vector3d& h_W, Candidates& best)
      : tree_(tree), query_(query), probe_(query), h_W_(h_W), best_(best) {}

  void run();

 private:
  static constexpr std::uint32_t kHits = 64;

  struct Hit {
    std::uint32_t run, segment;
    float squared;
  };

  void descend(std::uint32_t at);
  // Searches boxes of nodes of a level, or of runs at level -1. Boxes much nearer than the bound come first, which
  // tightens the bound.
  void visit(int level, BoxList& list) {
    if (level >= 0) return expand(level, list);
    BoxList near, far;
    list.split(bound_ * kMuchNearer, near);
    if (near.size > 0) siftAll(near);
    list.split(bound_, far);
    if (far.size > 0) siftAll(far);
  }
  void expand(int level, const BoxList& nodes);
  void siftAll(const BoxList& runs);
  template <class Run>
  void siftAll(const Run* points, const BoxList& runs);
  void keep(const std::uint32_t* runs, unsigned lanes, const float* squared);
  void tighten(float squared) {
    least_ = squared;
    const double surely = query_.surely(squared);
    bound_ = std::min(bound_, query_.boxBound(best_.boundIf(surely)));
    kept_ = std::min(kept_, query_.siftBound(query_.boxBound(surely)));
  }

  static constexpr float kMuchNearer = 1.0f / 16;  // squared

  const Boxes& tree_;
  const Query& query_;
  const WideProbe probe_;
  const Vector3d& h_W_;
  Candidates& best_;
  float bound_ = kInfinity;          // of boxes, units
  float kept_ = kInfinity;           // of segments, quanta: those that may be the nearest
  float least_ = kInfinity;          // smallest distance of a segment
  std::uint32_t done_ = UINT32_MAX;  // the node of level 0 searched first
  std::uint32_t hit_count_ = 0;
  Hit hits_[kHits];
};

void WideSearch::run() {
  bound_ = query_.boxBound(best_.bound2());
  kept_ = query_.siftBound(query_.boxBound(best_.limit2()));
  const std::uint32_t top = tree_.level_count - 1, count = tree_.levels[top].nodes();
  const Node* nodes = &tree_.nodes[tree_.levels[top].begin];
  float squared[kTopNodes * kWidth];
  Floats nearest = filled(kInfinity);
  for (std::uint32_t n = 0; n < count; ++n) {
    const Floats d = present(probe_.squaredTo(nodes[n]), tree_.levels[top].children - kWidth * n);
    store(d, squared + kWidth * n);
    nearest = least(nearest, d);
  }
  const float first = least(nearest);
  if (!(first <= bound_)) return;
  std::uint32_t at = 0;
  for (;; at += kWidth)
    if (const unsigned mask = within(loaded(squared + at), first); mask != 0) {
      at += static_cast<std::uint32_t>(std::countr_zero(mask));
      break;
    }
  descend(at);

  BoxList list;
  for (std::uint32_t n = 0; n < count; ++n) {
    const Floats d = loaded(squared + kWidth * n);
    list.append(kWidth * n, d, top == 0 && n == done_ ? 0 : within(d, std::min(bound_, FLT_MAX)));
    if (list.full()) {
      visit(static_cast<int>(top) - 1, list);
      list.size = 0;
    }
  }
  visit(static_cast<int>(top) - 1, list);

  for (std::uint32_t i = 0; i < hit_count_; ++i)
    if (hits_[i].squared <= kept_) tree_.offer(hits_[i].run, hits_[i].segment, h_W_, best_);
}

// From a child of the top level down to eight runs, which are searched.
void WideSearch::descend(std::uint32_t at) {
  for (std::uint32_t level = tree_.level_count - 1; level > 0; --level) {
    const Level& below = tree_.levels[level - 1];
    const Floats there = present(probe_.squaredTo(tree_.nodes[below.begin + at]), below.children - kWidth * at);
    at = kWidth * at + static_cast<std::uint32_t>(std::countr_zero(within(there, least(there))));
  }
  done_ = at / kWidth;
  BoxList list;
  list.append(kWidth * done_, filled(0), tree_.present(0, done_));
  siftAll(list);
}

void WideSearch::expand(int level, const BoxList& nodes) {
  BoxList below;
  const auto l = static_cast<std::uint32_t>(level);
  const Node* at = &tree_.nodes[tree_.levels[l].begin];
  const std::uint32_t skipped = level == 0 ? done_ : UINT32_MAX;
  for (std::uint32_t i = 0; i < nodes.size; ++i) {
    const std::uint32_t node = nodes.at[i];
    const Floats d = probe_.squaredTo(at[node]);
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
  if (tree_.narrow.empty())
    siftAll(tree_.words.data(), runs);
  else
    siftAll(tree_.narrow.data(), runs);
}

template <class Run>
void WideSearch::siftAll(const Run* points, const BoxList& runs) {
  float squared[kListBoxes / 2 + kWidth][kWidth];
  Floats all = filled(kInfinity);
  std::uint32_t i = 0;
  for (; i + 1 < runs.size; i += 2) {
    const Floats d = sift(points[runs.at[i]], points[runs.at[i + 1]], query_.near);
    store(d, squared[i / 2]);
    all = least(all, d);
  }
  if (i < runs.size) {  // the second of two equal runs does not count
    const Run& last = points[runs.at[i]];
    const Floats d = present(sift(last, last, query_.near), kRun);
    store(d, squared[i / 2]);
    all = least(all, d);
  }
  if (const float nearest = least(all); nearest < least_) tighten(nearest);
  for (i = 0; i < runs.size; i += 2)
    if (const unsigned mask = within(loaded(squared[i / 2]), kept_); mask != 0) keep(runs.at + i, mask, squared[i / 2]);
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

void searchNearest(const Boxes& boxes, const Query& query, const Vector3d& h_W, Candidates& best) {
  WideSearch(boxes, query, h_W, best).run();
}

void searchOrdered(const Boxes& boxes, const Query& query, const Vector3d& h_W, Candidates& best) {
  struct Entry {
    float squared;
    std::uint32_t at;  // a node; at level kLeaf, a run
    std::uint32_t level;
  };
  constexpr std::uint32_t kLeaf = UINT32_MAX;
  Entry stack[(11 + kTopNodes) * kWidth];
  std::uint32_t depth = 0;
  float bound = query.boxBound(best.bound2());
  const WideProbe probe(query);
  const auto push = [&](std::uint32_t level, std::uint32_t at, std::uint32_t bottom) HWY_ATTR {
    float squared[kWidth];
    const Floats distances = probe.squaredTo(boxes.nodes[boxes.levels[level].begin + at]);
    store(distances, squared);
    unsigned left = within(distances, bound) & boxes.present(level, at);
    for (; left != 0; left &= left - 1) {  // farthest first
      const auto i = static_cast<std::uint32_t>(std::countr_zero(left));
      std::uint32_t place = depth++;
      for (; place > bottom && stack[place - 1].squared < squared[i]; --place) stack[place] = stack[place - 1];
      stack[place] = {squared[i], kWidth * at + i, level == 0 ? kLeaf : level - 1};
    }
  };
  const std::uint32_t top_level = boxes.level_count - 1;
  for (std::uint32_t at = 0; at < boxes.levels[top_level].nodes(); ++at) push(top_level, at, 0);
  while (depth > 0) {
    const Entry top = stack[--depth];
    if (top.squared > bound) continue;
    if (top.level != kLeaf) {
      push(top.level, top.at, depth);
      continue;
    }
    boxes.searchRun(top.at, h_W, best);
    bound = query.boxBound(best.bound2());
  }
}

// Stores the box of two consecutive runs along one axis. Unused lanes get the first child.
HWY_INLINE void boundAxis(const Axis& axis, hn::Mask<TagI> none, int shift, std::uint16_t* lo, std::uint16_t* hi) {
  const VecI child = hn::IfThenElse(none, hn::Broadcast<0>(axis.child), axis.child);
  const VecI parent = hn::IfThenElse(none, hn::Broadcast<0>(axis.parent), axis.parent);
  VecI low = hn::Min(child, parent), high = hn::Max(child, parent);
  low = hn::Min(low, hn::Shuffle1032(low)), high = hn::Max(high, hn::Shuffle1032(high));
  low = hn::Min(low, hn::Shuffle2301(low)), high = hn::Max(high, hn::Shuffle2301(high));
  high = hn::Add(high, hn::Set(TagI(), (1 << shift) - 1));
  std::int32_t lows[kLanes], highs[kLanes];
  hn::StoreU(low, TagI(), lows);
  hn::StoreU(high, TagI(), highs);
  for (std::size_t i = 0; i < kLanes; i += kRun) {
    lo[i / kRun] = static_cast<std::uint16_t>(lows[i] >> shift);
    hi[i / kRun] = static_cast<std::uint16_t>(highs[i] >> shift);
  }
}

// The boxes of two consecutive runs of a node.
template <class Run>
HWY_INLINE void boundRuns(const Run& a, const Run& b, int shift, Node& node, std::uint32_t lane) {
  for (std::size_t p = 0; p < kParts; ++p) {
    const Points points = pointsOf(a, b, p);
    const std::size_t to = lane + p * kLanes / kRun;
    boundAxis(points.axes.x, points.beyond, shift, &node.lo[0][to], &node.hi[0][to]);
    boundAxis(points.axes.y, points.beyond, shift, &node.lo[1][to], &node.hi[1][to]);
    boundAxis(points.axes.z, points.beyond, shift, &node.lo[2][to], &node.hi[2][to]);
  }
}
template <class Run>
void boundPairs(Boxes& boxes, const std::vector<Run>& runs) {
  for (std::uint32_t r = 0; r + 1 < runs.size(); r += 2)
    boundRuns(runs[r], runs[r + 1], boxes.shift, boxes.nodes[r / kWidth], r % kWidth);
}

void boundAll(Boxes& boxes) {
  const auto runs = static_cast<std::uint32_t>(boxes.levels[0].children);
  if (boxes.lean()) {
    boundPairs(boxes, boxes.narrow);
    boundPairs(boxes, boxes.words);
    if (runs % 2 == 0) return;
  }
  const std::uint64_t up = (std::uint64_t{1} << boxes.shift) - 1;
  for (std::uint32_t r = boxes.lean() ? runs - 1 : 0; r < runs; ++r) {
    Tile::Offset lo, hi;
    boxes.tile->bound(boxes.runs[r], lo, hi);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      boxes.nodes[r / kWidth].lo[axis][r % kWidth] = static_cast<std::uint16_t>(lo[axis] >> boxes.shift);
      boxes.nodes[r / kWidth].hi[axis][r % kWidth] = static_cast<std::uint16_t>((hi[axis] + up) >> boxes.shift);
    }
  }
}

void build(Boxes& boxes) {
  boundAll(boxes);
  const hn::FixedTag<std::uint16_t, kWidth> eight;
  for (std::uint32_t level = 1; level < boxes.level_count; ++level)
    for (std::uint32_t child = 0; child < boxes.levels[level].children; ++child) {
      const Node& below = boxes.nodes[boxes.levels[level - 1].begin + child];
      Node& node = boxes.nodes[boxes.levels[level].begin + child / kWidth];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        node.lo[axis][child % kWidth] = hn::GetLane(hn::MinOfLanes(eight, hn::Load(eight, below.lo[axis].data())));
        node.hi[axis][child % kWidth] = hn::GetLane(hn::MaxOfLanes(eight, hn::Load(eight, below.hi[axis].data())));
      }
    }
}

}  // namespace

// Not in the unnamed namespace: the table below names it.
Kernels kernels(const char* name) { return {name, build, searchNearest, searchOrdered}; }

}  // namespace filiform::internal::packed::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace filiform::internal::packed {

const std::vector<Kernels>& kernelsHere() {
  static const std::vector<Kernels> kAll = [] {
    std::vector<Kernels> all;
    const std::int64_t here = HWY_SUPPORTED_TARGETS;
#if HWY_TARGETS & HWY_EMU128
    all.push_back(N_EMU128::kernels("emulated"));  // every processor runs it
#endif
#if HWY_TARGETS & HWY_SSSE3
    if ((here & HWY_SSSE3) != 0) all.push_back(N_SSSE3::kernels("ssse3"));
#endif
#if HWY_TARGETS & HWY_SSE4
    if ((here & HWY_SSE4) != 0) all.push_back(N_SSE4::kernels("sse4"));
#endif
#if HWY_TARGETS & HWY_AVX2
    if ((here & HWY_AVX2) != 0) all.push_back(N_AVX2::kernels("avx2"));
#endif
#if HWY_TARGETS & HWY_AVX3
    if ((here & HWY_AVX3) != 0) all.push_back(N_AVX3::kernels("avx512"));
#endif
#if HWY_TARGETS & HWY_NEON
    if ((here & HWY_NEON) != 0) all.push_back(N_NEON::kernels("neon"));
#endif
#if HWY_TARGETS & HWY_WASM
    if ((here & HWY_WASM) != 0) all.push_back(N_WASM::kernels("wasm"));
#endif
    return all;
  }();
  return kAll;
}

}  // namespace filiform::internal::packed
#endif
