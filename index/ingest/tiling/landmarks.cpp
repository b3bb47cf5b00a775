#include "index/ingest/tiling/landmarks.h"

#include "index/geometry/internal/key_sort.h"
#include "index/geometry/partition.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>

namespace filiform {
namespace {

constexpr std::size_t kSegmentsPerPoint = 128, kLeastPoints = 64;
constexpr int kTableBits = 12;      // more blocks in a leaf than this are stored in a map
constexpr double kRounding = 0.87;  // largest rounding of a point to the grid, quanta
constexpr std::uint32_t kAbsent = UINT32_MAX;

// The smallest e with |a - b| <= 2^e quanta.
int lengthExponent(const GridPoint& a, const GridPoint& b) {
  __extension__ using Product = unsigned __int128;
  constexpr std::int64_t kNear = std::int64_t{1} << 30;
  const std::int64_t x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  if (((x + kNear) | (y + kNear) | (z + kNear)) >> 31 == 0) {  // nearly all
    const auto squared = static_cast<std::uint64_t>(x * x + y * y + z * z);
    return squared <= 1 ? 0 : (std::bit_width(squared - 1) + 1) / 2;
  }
  Product squared = 0;
  for (int i = 0; i < 3; ++i) {
    const auto d = static_cast<std::uint64_t>(std::abs(a[i] - b[i]));
    squared += Product{d} * d;
  }
  if (squared <= 1) return 0;
  const Product below = squared - 1;
  const auto high = static_cast<std::uint64_t>(below >> 64);
  const int bits = high != 0 ? 64 + std::bit_width(high) : std::bit_width(static_cast<std::uint64_t>(below));
  return (bits + 1) / 2;
}

// Number of bits of an axis among the first `depth` bits of a key.
int axisBits(int depth, int axis) { return (depth + 2 - axis) / 3; }

MortonKey prefix(MortonKey key, int depth) {
  return depth == 0 ? 0 : key >> (kMortonBits - depth) << (kMortonBits - depth);
}

double squaredDistance(const GridPoint& a, const GridPoint& b) { return (a - b).cast<double>().squaredNorm(); }

// The point at odd / (2 pieces) of the segment.
GridPoint interior(const StoredSegment& s, std::uint64_t odd, std::uint64_t pieces) {
  __extension__ using Product = __int128;
  GridPoint p;
  for (int i = 0; i < 3; ++i) {
    const Product divisor = Product{pieces} * 2,
                  doubled = Product{s.parent[i] - s.child[i]} * odd + pieces;  // rounded to the nearest
    Product step = doubled / divisor;
    if (doubled < 0 && doubled % divisor != 0) --step;
    p[i] = s.child[i] + static_cast<std::int64_t>(step);
  }
  return p;
}

}  // namespace

std::size_t landmarksFor(std::uint64_t segments) {
  return static_cast<std::size_t>(std::clamp<std::uint64_t>(segments / kSegmentsPerPoint, kLeastPoints, kMaxLandmarks));
}

void LandmarkSurvey::addLength(const GridPoint& a, const GridPoint& b) {
  ++longer_[static_cast<std::size_t>(lengthExponent(a, b))];
}

void LandmarkSurvey::join(MortonKey next) {
  const MortonKey differing = last_ ^ next;
  if (differing == 0) return;
  const auto high = static_cast<std::uint64_t>(differing >> 64);
  const int width = high != 0 ? 64 + std::bit_width(high) : std::bit_width(static_cast<std::uint64_t>(differing));
  ++differ_[static_cast<std::size_t>(kMortonBits - width)];
}

void LandmarkSurvey::addKeys(std::span<const MortonKey> sorted) {
  if (sorted.empty()) return;
  if (keys_ == 0) first_ = last_ = sorted.front();
  for (const MortonKey key : sorted) join(key), last_ = key;
  keys_ += sorted.size();
}

void LandmarkSurvey::add(const LandmarkSurvey& next) {
  for (std::size_t i = 0; i < longer_.size(); ++i) longer_[i] += next.longer_[i];
  if (next.keys_ == 0) return;
  if (keys_ == 0) {
    first_ = next.first_;
  } else {
    join(next.first_);
  }
  for (std::size_t i = 0; i < differ_.size(); ++i) differ_[i] += next.differ_[i];
  last_ = next.last_;
  keys_ += next.keys_;
}

LandmarkChooser::LandmarkChooser(const Grid& grid, const LandmarkSurvey& survey, std::size_t most) : grid_(grid) {
  // The deepest partition with at most `wanted` occupied blocks.
  const auto finest = [&](std::uint64_t wanted) {
    std::uint64_t occupied = 1;
    int depth = 0;
    while (depth < kMortonBits && (occupied += survey.differ_[static_cast<std::size_t>(depth)]) <= wanted) ++depth;
    return depth;
  };
  const std::size_t for_pieces = most / 4;
  const int longest = kMortonAxisBits + 2;
  const auto pieces = [&](int exponent) {
    double sum = 0;
    for (int e = exponent + 1; e <= longest; ++e)
      sum += std::ldexp(static_cast<double>(survey.longer_[static_cast<std::size_t>(e)]), e - exponent);
    return sum;
  };
  // Pieces shorter than a block would not improve the cover.
  piece_exponent_ = kMortonAxisBits - axisBits(finest(most - for_pieces), 2);
  while (pieces(piece_exponent_) > static_cast<double>(for_pieces)) ++piece_exponent_;
  depth_ = finest(most - static_cast<std::size_t>(pieces(piece_exponent_)));
}

void LandmarkChooser::addLeaf(const BlockKey& leaf, std::span<const StoredSegment> segments, Part& part) const {
  const GridPoint lo = leaf.box().lo;
  const int bits = std::max(0, depth_ - leaf.depth);
  std::array<int, 3> shift{}, place{};
  for (int axis = 0, at = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    shift[i] = kMortonAxisBits - axisBits(depth_, axis);
    place[i] = at;
    at += bits == 0 ? 0 : axisBits(depth_, axis) - axisBits(leaf.depth, axis);
  }
  if (bits <= kTableBits) part.table_.assign(std::size_t{1} << bits, kAbsent);
  part.sparse_.clear();
  part.group_of_.assign(segments.size(), kAbsent);
  const auto slot = [&](const GridPoint& p) -> std::uint32_t& {
    if (bits == 0) return part.table_[0];
    if (bits > kTableBits) return part.sparse_.try_emplace(prefix(mortonKey(p), depth_), kAbsent).first->second;
    std::size_t index = 0;
    for (std::size_t i = 0; i < 3; ++i)
      index |=
          static_cast<std::size_t>((p[static_cast<Eigen::Index>(i)] - lo[static_cast<Eigen::Index>(i)]) >> shift[i])
          << place[i];
    return part.table_[index];
  };
  const auto centre2 = [&](const GridPoint& p) {  // twice the centre of the point's block
    GridPoint c;
    for (int i = 0; i < 3; ++i) {
      const int s = shift[static_cast<std::size_t>(i)];
      // Blocks are aligned to their edges, except the whole world.
      c[i] = s == kMortonAxisBits ? -1 : ((p[i] >> s) << (s + 1)) + (std::int64_t{1} << s) - 1;
    }
    return c;
  };

  const std::size_t first = part.groups_.size();
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const StoredSegment& s = segments[i];
    if (!s.owned) continue;
    const int exponent = lengthExponent(s.child, s.parent);
    if (exponent > piece_exponent_) {
      const double length = std::sqrt(squaredDistance(s.child, s.parent));
      const auto n =
          std::min<std::uint64_t>(std::uint64_t{1} << (exponent - piece_exponent_),
                                  static_cast<std::uint64_t>(std::floor(std::ldexp(length, -piece_exponent_))) + 1);
      for (std::uint64_t k = 0; k < n; ++k)
        part.pieces_.push_back({interior(s, 2 * k + 1, n), s.id,
                                static_cast<float>(static_cast<double>(2 * k + 1) / static_cast<double>(2 * n))});
      part.piece_radius_ = std::max(part.piece_radius_, length / (2 * static_cast<double>(n)) + kRounding);
      continue;
    }
    const GridPoint middle = midpoint(s.child, s.parent);
    const double distance2 = squaredDistance(2 * middle, centre2(middle));
    std::uint32_t& at = slot(middle);
    if (at == kAbsent) {
      at = static_cast<std::uint32_t>(part.groups_.size());
      part.groups_.push_back({0, middle, distance2, s.id, {}, 0});
    } else {
      Part::Group& group = part.groups_[at];
      if (std::tie(distance2, s.id) < std::tie(group.distance2, group.id))
        group.point = middle, group.distance2 = distance2, group.id = s.id;
    }
    part.group_of_[i] = at;
  }
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (part.group_of_[i] == kAbsent) continue;
    const StoredSegment& s = segments[i];
    Part::Group& group = part.groups_[part.group_of_[i]];
    group.ends.extend(s.child);
    group.radius2 = std::max(group.radius2, squaredDistance(s.child, group.point));
    if (i > 0 && part.group_of_[i - 1] == part.group_of_[i] && s.parent == segments[i - 1].child) continue;
    group.ends.extend(s.parent);
    group.radius2 = std::max(group.radius2, squaredDistance(s.parent, group.point));
  }
  for (std::size_t g = first; g < part.groups_.size(); ++g)
    part.groups_[g].block = prefix(mortonKey(part.groups_[g].point), depth_);
}

Landmarks LandmarkChooser::finish(std::span<Part> parts) const {
  std::vector<Part::Group> groups;
  std::vector<Part::Piece> points;
  double radius = 0;  // quanta
  for (Part& part : parts) {
    groups.insert(groups.end(), part.groups_.begin(), part.groups_.end());
    points.insert(points.end(), part.pieces_.begin(), part.pieces_.end());
    radius = std::max(radius, part.piece_radius_);
    part = {};
  }
  std::sort(groups.begin(), groups.end(), [](const Part::Group& a, const Part::Group& b) {
    return std::tie(a.block, a.distance2, a.id) < std::tie(b.block, b.distance2, b.id);
  });
  for (std::size_t begin = 0, end; begin < groups.size(); begin = end) {
    const Part::Group& best = groups[begin];
    points.push_back({best.point, best.id, 0.5f});
    for (end = begin + 1; end < groups.size() && groups[end].block == best.block;) ++end;
    double radius2 = best.radius2;
    for (std::size_t g = begin + 1; g < end; ++g) {
      const GridPoint farthest =
          (best.point - groups[g].ends.lo).cwiseAbs().cwiseMax((best.point - groups[g].ends.hi).cwiseAbs());
      radius2 = std::max(radius2, farthest.cast<double>().squaredNorm());
    }
    radius = std::max(radius, std::sqrt(radius2));
  }
  groups = {};
  std::vector<std::pair<MortonKey, Part::Piece>> sorted;
  sorted.reserve(points.size());
  for (const Part::Piece& point : points) sorted.emplace_back(mortonKey(point.point), point);
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return std::tie(a.first, a.second.id, a.second.t) < std::tie(b.first, b.second.id, b.second.t);
  });
  Landmarks result;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    if (i > 0 && sorted[i].first == sorted[i - 1].first) continue;
    result.points.push_back(sorted[i].second.point);
    result.segments.push_back(sorted[i].second.id);
    result.t.push_back(sorted[i].second.t);
  }
  result.covering_radius_um = radius * (1 + 1e-12) * grid_.quantum_um();
  return result;
}

Landmarks chooseLandmarks(const TileStore& store, std::size_t most) {
  LandmarkSurvey survey;
  std::vector<MortonKey> keys;
  const auto each = [&](const auto& use) {
    for (TileId t = 0; t < store.tile_count(); ++t) {
      const std::shared_ptr<const Tile> tile = store.load(t);
      std::vector<StoredSegment> segments;
      for (std::uint32_t s = 0; s < tile->segment_count(); ++s)
        if (tile->owned(s))
          segments.push_back(
              {tile->segmentId(s), 0, 0, tile->gridPoint(tile->child(s)), tile->gridPoint(tile->parent(s)), true});
      use(tile->key(), segments);
    }
  };
  each([&](const BlockKey&, std::span<const StoredSegment> segments) {
    for (const StoredSegment& s : segments) {
      survey.addLength(s.child, s.parent);
      keys.push_back(mortonKey(midpoint(s.child, s.parent)));
    }
  });
  internal::sortKeys(keys);
  survey.addKeys(keys);
  if (most == 0) most = landmarksFor(keys.size());
  keys = {};
  const LandmarkChooser chooser(store.grid(), survey, most);
  LandmarkChooser::Part part;
  each([&](const BlockKey& key, std::span<const StoredSegment> segments) { chooser.addLeaf(key, segments, part); });
  return chooser.finish({&part, 1});
}

Landmarks chooseLandmarks(const TileStore& store) { return chooseLandmarks(store, 0); }

}  // namespace filiform
