#include "index/samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <unordered_map>

namespace filiform {
namespace {

constexpr std::size_t kPointsPerSegment = 4;  // more would take more bytes than the segments

// A point that may become a sample: an end of a segment, or an interior point of a long one.
struct Points {
  std::vector<GridPoint> at;
  std::vector<std::uint32_t> child, parent;  // of each segment: its ends among the points

  struct Cut {  // interior points of a long segment: first .. first + pieces - 2, from the child on
    std::uint32_t segment, first, pieces;
  };
  std::vector<Cut> cuts;
};

double distance(const GridPoint& a, const GridPoint& b) { return (a - b).cast<double>().norm(); }

// The shortest piece length, in quarter octaves, for which cutting every longer segment adds at most `most` points.
double pieceLength(const std::vector<double>& lengths, std::size_t most) {
  constexpr std::array<double, 4> kQuarters{1.0, 1.189207115002721, 1.4142135623730951, 1.681792830507429};
  const auto length = [&](int quarter) { return std::ldexp(kQuarters[quarter % 4], quarter / 4); };
  const auto fits = [&](double piece) {
    double added = 0;
    for (double l : lengths)
      if (l > piece) added += std::floor(l / piece);
    return added <= static_cast<double>(most);
  };
  int low = 0, high = 4 * (kMortonAxisBits + 2);  // the second always fits: no segment is longer
  while (low < high) {
    const int middle = (low + high) / 2;
    if (fits(length(middle))) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return length(low);
}

GridPoint interior(const SegmentEnds& s, std::uint32_t piece, std::uint32_t pieces) {
  GridPoint p;
  for (int i = 0; i < 3; ++i) {
    __extension__ using Wide = __int128;
    const Wide doubled = Wide{s.parent[i] - s.child[i]} * piece * 2 + pieces;  // rounded to the nearest
    const Wide divisor = Wide{pieces} * 2;
    Wide step = doubled / divisor;
    if (doubled < 0 && doubled % divisor != 0) --step;
    p[i] = s.child[i] + static_cast<std::int64_t>(step);
  }
  return p;
}

Points collect(std::span<const SegmentEnds> segments, std::size_t most) {
  Points points;
  points.at.reserve(segments.size() + segments.size() / 8);
  points.child.reserve(segments.size());
  points.parent.reserve(segments.size());
  std::vector<double> lengths;
  lengths.reserve(segments.size());
  const auto add = [&](const GridPoint& p) {
    points.at.push_back(p);
    return static_cast<std::uint32_t>(points.at.size() - 1);
  };
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const SegmentEnds& s = segments[i];
    // Along a run the parent is the child before: one point, not two.
    const bool follows = i > 0 && segments[i - 1].child == s.parent;
    const std::uint32_t before = follows ? points.child.back() : 0;
    points.child.push_back(add(s.child));
    points.parent.push_back(follows ? before : s.parent == s.child ? points.child.back() : add(s.parent));
    lengths.push_back(distance(s.child, s.parent));
  }
  const double piece = pieceLength(lengths, 2 * most);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (!(lengths[i] > piece)) continue;
    const auto pieces = static_cast<std::uint32_t>(std::floor(lengths[i] / piece)) + 1;
    points.cuts.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(points.at.size()), pieces});
    for (std::uint32_t k = 1; k < pieces; ++k) add(interior(segments[i], k, pieces));
  }
  return points;
}

struct Group {
  std::size_t begin, end;
  GridBox box;
  double diagonal2;
  bool operator<(const Group& other) const {  // largest first; equal ones by place, which depends on sizes only
    return diagonal2 != other.diagonal2 ? diagonal2 < other.diagonal2 : begin > other.begin;
  }
};

Group group(const Points& points, const std::vector<std::uint32_t>& order, std::size_t begin, std::size_t end) {
  Group g{begin, end, {}, 0};
  for (std::size_t i = begin; i < end; ++i) g.box.extend(points.at[order[i]]);
  g.diagonal2 = (g.box.hi - g.box.lo).cast<double>().squaredNorm();
  return g;
}

bool lexicographic(const GridPoint& a, const GridPoint& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

struct Hash {
  std::size_t operator()(const GridPoint& p) const {
    std::uint64_t h = 0;
    for (int i = 0; i < 3; ++i) h = (h ^ static_cast<std::uint64_t>(p[i])) * 0x9E3779B97F4A7C15ull, h ^= h >> 29;
    return h;
  }
};

// For a piece a-b with length L whose ends are u and v away from samples s and t, every point x of it is within the
// least of
//   max(|a-s|, |b-s|)   the distance to one sample is convex along the piece,
//   max(|a-t|, |b-t|)   likewise,
//   (u + v + L) / 2     min(u + |a-x|, v + |x-b|) is at most the mean of the two, and |a-x| + |x-b| = L.
double pieceRadius(const GridPoint& a, const GridPoint& b, const GridPoint& s, const GridPoint& t) {
  const double u = distance(a, s), v = distance(b, t);
  const double by_s = std::max(u, distance(b, s)), by_t = std::max(distance(a, t), v);
  return std::min({by_s, by_t, (u + v + distance(a, b)) / 2});
}

}  // namespace

SamplePoints chooseSamples(std::span<const SegmentEnds> segments, const Grid& grid, std::size_t most) {
  SamplePoints result;
  if (segments.empty() || most == 0) return result;
  most = std::min(most, kPointsPerSegment * segments.size());
  const Points points = collect(segments, most);
  std::vector<std::uint32_t> order(points.at.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);

  std::priority_queue<Group> groups;
  groups.push(group(points, order, 0, order.size()));
  while (groups.size() < most && groups.top().diagonal2 > 0) {
    const Group g = groups.top();
    groups.pop();
    int axis = 0;
    const GridPoint extent = g.box.hi - g.box.lo;
    extent.maxCoeff(&axis);
    const std::int64_t plane = g.box.lo[axis] + extent[axis] / 2;  // both halves hold something
    const auto middle = std::partition(order.begin() + static_cast<std::ptrdiff_t>(g.begin),
                                       order.begin() + static_cast<std::ptrdiff_t>(g.end),
                                       [&](std::uint32_t i) { return points.at[i][axis] <= plane; });
    const auto at = static_cast<std::size_t>(middle - order.begin());
    groups.push(group(points, order, g.begin, at));
    groups.push(group(points, order, at, g.end));
  }

  std::vector<std::uint32_t> sample_of(points.at.size());  // point -> the point that stands for it
  std::vector<std::uint32_t> chosen;
  for (; !groups.empty(); groups.pop()) {
    const Group& g = groups.top();
    const GridPoint centre2 = g.box.lo + g.box.hi;
    std::uint32_t best = order[g.begin];
    double best_distance = INFINITY;
    for (std::size_t i = g.begin; i < g.end; ++i) {
      const GridPoint& p = points.at[order[i]];
      const double d = (2 * p - centre2).cast<double>().squaredNorm();
      if (d < best_distance || (d == best_distance && lexicographic(p, points.at[best])))
        best = order[i], best_distance = d;
    }
    for (std::size_t i = g.begin; i < g.end; ++i) sample_of[order[i]] = best;
    chosen.push_back(best);
  }
  std::sort(chosen.begin(), chosen.end(),
            [&](std::uint32_t a, std::uint32_t b) { return mortonKey(points.at[a]) < mortonKey(points.at[b]); });

  double radius = 0;
  const auto cover = [&](std::uint32_t a, std::uint32_t b, double slack) {
    const GridPoint &p = points.at[a], &q = points.at[b];
    radius = std::max(radius, slack + pieceRadius(p, q, points.at[sample_of[a]], points.at[sample_of[b]]));
  };
  auto cut = points.cuts.begin();
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (cut == points.cuts.end() || cut->segment != i) {
      cover(points.child[i], points.parent[i], 0);
      continue;
    }
    // Interior points were rounded, so the true segment runs within half a quantum an axis of the pieces.
    std::uint32_t from = points.child[i];
    for (std::uint32_t k = 0; k + 1 < cut->pieces; ++k) {
      cover(from, cut->first + k, 0.87);
      from = cut->first + k;
    }
    cover(from, points.parent[i], 0.87);
    ++cut;
  }
  result.covering_radius_um = radius * (1 + 1e-12) * grid.quantum_um();

  // The lowest segment that holds each point: ends first, whichever cell they are of, then the segment that was cut
  // there.
  std::unordered_map<GridPoint, std::uint32_t, Hash> slots;
  slots.reserve(2 * chosen.size());
  result.segments.assign(chosen.size(), {UINT32_MAX, UINT32_MAX});
  result.t.assign(chosen.size(), 0.0f);
  for (std::uint32_t point : chosen) {
    slots.emplace(points.at[point], static_cast<std::uint32_t>(result.points.size()));
    result.points.push_back(points.at[point]);
  }
  const auto claim = [&](const GridPoint& p, SegmentId id, float t) {
    const auto slot = slots.find(p);
    if (slot == slots.end() || !(id < result.segments[slot->second])) return;
    result.segments[slot->second] = id;
    result.t[slot->second] = t;
  };
  cut = points.cuts.begin();
  for (std::size_t i = 0; i < segments.size(); ++i) {
    claim(segments[i].child, segments[i].id, 0.0f);
    claim(segments[i].parent, segments[i].id, 1.0f);
    if (cut == points.cuts.end() || cut->segment != i) continue;
    for (std::uint32_t k = 1; k < cut->pieces; ++k)
      claim(points.at[cut->first + k - 1], segments[i].id, static_cast<float>(k) / static_cast<float>(cut->pieces));
    ++cut;
  }
  return result;
}

SamplePoints chooseSamples(const TileStore& store, std::size_t most) {
  std::vector<SegmentEnds> segments;
  for (TileId t = 0; t < store.tile_count(); ++t) {
    const std::shared_ptr<const Tile> tile = store.load(t);
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s)
      if (tile->owned(s))
        segments.push_back({tile->segmentId(s), tile->gridPoint(tile->child(s)), tile->gridPoint(tile->parent(s))});
  }
  std::sort(segments.begin(), segments.end(), [](const SegmentEnds& a, const SegmentEnds& b) { return a.id < b.id; });
  return chooseSamples(segments, store.grid(), most);
}

}  // namespace filiform
