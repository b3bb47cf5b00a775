#include "index/levels/internal/neurites.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace filiform {
namespace {

// Rounds up by more than the error of the distances below.
constexpr double kRoundUp = 1 + 1e-12;
// A segment of one simplification represents at most this many segments: bounds the time for straight paths.
constexpr std::size_t kMostMerged = 64;

constexpr std::size_t kNoPath = SIZE_MAX;

std::uint64_t nodeKey(std::uint32_t cell, std::uint32_t sample) { return std::uint64_t{cell} << 32 | sample; }

// Collects segments in the order of their ids into paths.
class PathBuilder {
 public:
  explicit PathBuilder(std::size_t segments) { out_.points.reserve(segments + segments / 8); }

  void add(std::uint32_t cell, std::uint32_t child_sample, std::uint32_t parent_sample, const GridPoint& child,
           const GridPoint& parent, float radius_um, std::uint16_t type) {
    ++out_.represented;
    const auto at = static_cast<std::uint32_t>(out_.points.size());
    if (child_sample == parent_sample) {
      out_.paths.push_back({cell, child_sample, child_sample, kNoSample, at, 1});
      out_.points.push_back({child, radius_um, type, 1});
      return;
    }
    NeuritePath* path = out_.paths.empty() ? nullptr : &out_.paths.back();
    const bool continues = path != nullptr && path->cell == cell && path->last_sample == parent_sample &&
                           child_sample == parent_sample + 1 && !path->isBall();
    if (!continues) {
      out_.paths.push_back({cell, parent_sample, parent_sample, child_sample, at, 1});
      out_.points.push_back({parent, radius_um, type, 0});
      path = &out_.paths.back();
    }
    path->last_sample = child_sample;
    ++path->count;
    out_.points.push_back({child, radius_um, type, 1});
  }
  Neurites take() { return std::move(out_); }

 private:
  Neurites out_;
};

// Finds, for a sample, the path that passes through it, and for an end the path that continues there.
class PathIndex {
 public:
  explicit PathIndex(const Neurites& all) : paths_(all.paths) {
    for (std::size_t i = 0; i < paths_.size(); ++i) {
      const NeuritePath& path = paths_[i];
      if (path.lowest != kNoSample || path.isBall())
        ranges_.emplace_back(nodeKey(path.cell, path.isBall() ? path.first_sample : path.lowest), i);
      if (path.last_sample != kNoSample && !path.isBall()) ends_.emplace_back(nodeKey(path.cell, path.last_sample), i);
    }
    if (!std::is_sorted(ranges_.begin(), ranges_.end())) std::sort(ranges_.begin(), ranges_.end());
    if (!std::is_sorted(ends_.begin(), ends_.end())) std::sort(ends_.begin(), ends_.end());
  }

  // The path, other than `self`, that passes through the first sample of path `self`.
  std::size_t carrierOf(std::size_t self) const {
    const NeuritePath& path = paths_[self];
    if (path.first_sample == kNoSample || path.isBall()) return kNoPath;
    const std::uint64_t key = nodeKey(path.cell, path.first_sample);
    // A path also passes through its first sample, if that comes just before its lowest.
    auto after = std::upper_bound(ranges_.begin(), ranges_.end(), std::pair{key + 1, SIZE_MAX});
    for (int tries = 0; tries < 2 && after != ranges_.begin(); ++tries) {
      const std::size_t other = (--after)->second;
      const NeuritePath& o = paths_[other];
      if (other == self || o.cell != path.cell) continue;
      const bool begins_there = o.first_sample == path.first_sample && (o.isBall() || o.lowest < path.lowest);
      const bool passes =
          !o.isBall() && o.lowest <= path.first_sample && path.first_sample <= o.last_sample && o.lowest != kNoSample;
      if (begins_there || passes) return other;
    }
    return kNoPath;
  }
  // A path that ends at the first sample of path `self`: the one before, or else the lowest.
  std::size_t beforeOf(std::size_t self) const {
    const NeuritePath& path = paths_[self];
    if (path.first_sample == kNoSample || path.isBall()) return kNoPath;
    if (self > 0) {  // usual
      const NeuritePath& o = paths_[self - 1];
      if (o.cell == path.cell && o.last_sample == path.first_sample && !o.isBall()) return self - 1;
    }
    const std::uint64_t key = nodeKey(path.cell, path.first_sample);
    const auto found = std::lower_bound(ends_.begin(), ends_.end(), std::pair{key, std::size_t{0}});
    return found != ends_.end() && found->first == key && found->second != self ? found->second : kNoPath;
  }

 private:
  const std::vector<NeuritePath>& paths_;
  std::vector<std::pair<std::uint64_t, std::size_t>> ranges_, ends_;
};

// Appends the paths that follow `first` to one path.
void appendChain(const Neurites& from, std::size_t first, const std::vector<std::size_t>& next,
                 std::vector<bool>& taken, Neurites& to) {
  NeuritePath path = from.paths[first];
  path.begin = static_cast<std::uint32_t>(to.points.size());
  path.count = 0;
  for (std::size_t i = first; i != kNoPath && !taken[i]; i = next[i]) {
    taken[i] = true;
    const NeuritePath& piece = from.paths[i];
    const std::uint32_t skip = i == first ? 0 : 1;  // the shared sample
    if (i != first && (path.lowest == kNoSample || piece.lowest != path.last_sample + 1)) path.lowest = kNoSample;
    path.last_sample = piece.last_sample;
    to.points.insert(to.points.end(), from.points.begin() + piece.begin + skip,
                     from.points.begin() + piece.begin + piece.count);
    path.count += piece.count - skip;
  }
  to.paths.push_back(path);
}

// The paths are one run of samples, or their samples are in no order.
bool isConsecutive(const NeuritePath& a, const NeuritePath& b) {
  return a.lowest == kNoSample || b.lowest == kNoSample || b.lowest == a.last_sample + 1;
}

// Links paths where one ends at the first sample of another, and marks attached ones. A path continues with the next
// sample in file order; the other branches are attached. In cells whose samples are in no order, a path continues with
// any branch.
Neurites withLinks(Neurites all) {
  constexpr std::size_t kScattered = 3;  // points a path, at most
  const bool scattered = all.points.size() < kScattered * all.paths.size();
  std::vector<std::size_t> next(all.paths.size(), kNoPath);
  std::vector<bool> has_before(all.paths.size(), false), taken(all.paths.size(), false);
  bool any = false;
  {
    const PathIndex index(all);
    for (std::size_t i = 0; i < all.paths.size(); ++i) {
      const std::size_t before = index.beforeOf(i);
      const bool follows =
          before != kNoPath && next[before] == kNoPath && (scattered || isConsecutive(all.paths[before], all.paths[i]));
      if (follows && !all.paths[i].attached) {
        next[before] = i;
        has_before[i] = any = true;
      } else if (!all.paths[i].attached) {
        all.paths[i].attached = index.carrierOf(i) != kNoPath;
      }
    }
  }
  if (!any) return all;
  Neurites out;
  out.points.reserve(all.points.size());
  out.error_um = all.error_um;
  out.pixel_um = all.pixel_um;
  out.represented = all.represented;
  out.hidden = all.hidden;
  out.hidden_um = all.hidden_um;
  for (std::size_t i = 0; i < all.paths.size(); ++i)
    if (!has_before[i]) appendChain(all, i, next, taken, out);
  for (std::size_t i = 0; i < all.paths.size(); ++i)  // loops
    if (!taken[i]) appendChain(all, i, next, taken, out);
  return out;
}

double distance(const Vector3d& p, const Vector3d& a, const Vector3d& way, double squared) {
  const Vector3d d = p - a;
  const double t = squared > 0 ? std::clamp(d.dot(way) / squared, 0.0, 1.0) : 0.0;
  return (d - t * way).norm();
}

// Simplifies one path after another, in place.
class Simplifier {
 public:
  Simplifier(const Grid& grid, double tolerance_um) : grid_(grid), tolerance_um_(tolerance_um) {}

  double largest() const { return largest_um_; }

  // The greatest distance of the path's points from its first; infinite if it exceeds `most_um` by much.
  double reach(const NeuritePoint* points, std::size_t count, double most_um) const {
    std::int64_t most = 0;
    for (std::size_t i = 1; i < count; ++i) {
      const GridPoint way = (points[i].p - points[0].p).cwiseAbs();
      most = std::max(most, way.maxCoeff());
      if (static_cast<double>(most) * grid_.quantum_um() > most_um) return INFINITY;
    }
    double reach_um = 0;
    for (std::size_t i = 1; i < count; ++i)
      reach_um = std::max(reach_um, (points[i].p - points[0].p).cast<double>().norm() * grid_.quantum_um());
    return reach_um * kRoundUp;
  }

  // Writes what remains of the path to `out`, which may be the path itself. Returns the number of points.
  std::size_t shorten(const NeuritePoint* points, std::size_t count, NeuritePoint* out) {
    at_.resize(count);
    for (std::size_t i = 0; i < count; ++i) at_[i] = (points[i].p - points[0].p).cast<double>() * grid_.quantum_um();
    std::size_t written = 0;
    out[written++] = points[0];
    for (std::size_t from = 0; from + 1 < count;) {
      std::size_t to = from + 1;
      double error_um = 0;
      for (std::size_t next = from + 2; next < std::min(count, from + kMostMerged + 1); ++next) {
        const double error = errorOf(from, next);
        if (error > tolerance_um_) break;
        to = next;
        error_um = error;
      }
      largest_um_ = std::max(largest_um_, error_um);
      out[written++] = merged(points, from, to);
      from = to;
    }
    return written;
  }

 private:
  double errorOf(std::size_t from, std::size_t to) const {
    const Vector3d way = at_[to] - at_[from];
    const double squared = way.squaredNorm();
    double worst = 0;
    for (std::size_t i = to; --i > from;) {
      worst = std::max(worst, distance(at_[i], at_[from], way, squared) * kRoundUp);
      if (worst > tolerance_um_) break;
    }
    return worst;
  }

  NeuritePoint merged(const NeuritePoint* points, std::size_t from, std::size_t to) const {
    if (to == from + 1) return points[to];
    NeuritePoint out = points[to];
    double weight = 0, radius = 0;
    out.segments = 0;
    for (std::size_t i = from + 1; i <= to; ++i) {
      out.segments += points[i].segments;
      if (std::isnan(points[i].radius_um)) continue;
      const double one = std::max(1u, points[i].segments);
      weight += one;
      radius += one * static_cast<double>(points[i].radius_um);
    }
    out.radius_um = weight > 0 ? static_cast<float>(radius / weight) : std::numeric_limits<float>::quiet_NaN();
    return out;
  }

  const Grid& grid_;
  double tolerance_um_, largest_um_ = 0;
  std::vector<Vector3d> at_;
};

// Of the short paths, removes those from `gone` that have no carrier, or one that may go too. Adds what the others
// represent to the paths that carry them.
void chargeCarriers(Neurites& all, std::vector<bool>& gone) {
  const PathIndex index(all);
  const std::vector<bool> is_short = gone;
  for (std::size_t i = 0; i < all.paths.size(); ++i) {
    if (!gone[i]) continue;
    const std::size_t carrier = index.carrierOf(i);
    // A carrier may be hidden.
    if (carrier == kNoPath || is_short[carrier]) {
      gone[i] = false;
      continue;
    }
    std::uint32_t sum = 0;
    for (std::uint32_t k = 0; k < all.paths[i].count; ++k) sum += all.points[all.paths[i].begin + k].segments;
    all.points[all.paths[carrier].begin + all.paths[carrier].count - 1].segments += sum;
  }
}

bool inOrder(std::span<const NeuritePath> paths) {  // the order of their points
  return std::is_sorted(paths.begin(), paths.end(),
                        [](const NeuritePath& a, const NeuritePath& b) { return a.begin < b.begin; });
}

}  // namespace

Neurites neuritesOf(std::span<const StoredSegment> segments, const TileAppearance& appearance) {
  PathBuilder builder(segments.size());
  std::size_t owned = 0;
  for (const StoredSegment& s : segments) {
    if (!s.owned) continue;
    builder.add(s.id.cell, s.child_sample, s.parent_sample, s.child, s.parent, appearance.radii_um[owned],
                appearance.types[owned]);
    ++owned;
  }
  return withLinks(builder.take());
}

Neurites neuritesOf(const Tile& tile, const TileAppearance& appearance) {
  PathBuilder builder(tile.owned_count());
  std::size_t owned = 0;
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    if (!tile.owned(s)) continue;
    const Tile::Link link = tile.link(s);
    builder.add(link.id.cell, link.child_id.sample, link.parent_id.sample, tile.gridPoint(link.child),
                tile.gridPoint(link.parent), appearance.radii_um[owned], appearance.types[owned]);
    ++owned;
  }
  return withLinks(builder.take());
}

Neurites linked(Neurites all) {
  std::stable_sort(all.paths.begin(), all.paths.end(), [](const NeuritePath& a, const NeuritePath& b) {
    return nodeKey(a.cell, a.lowest) < nodeKey(b.cell, b.lowest);
  });
  return withLinks(std::move(all));
}

void append(Neurites& all, const Neurites& part) {
  const auto shift = static_cast<std::uint32_t>(all.points.size());
  for (NeuritePath path : part.paths) {
    path.begin += shift;
    all.paths.push_back(path);
  }
  all.points.insert(all.points.end(), part.points.begin(), part.points.end());
  all.error_um = std::max(all.error_um, part.error_um);
  all.pixel_um = std::max(all.pixel_um, part.pixel_um);
  all.represented += part.represented;
  all.hidden += part.hidden;
  all.hidden_um += part.hidden_um;
}

Neurites join(std::vector<Neurites> parts) {
  Neurites all;
  for (const Neurites& part : parts) append(all, part);
  return linked(std::move(all));
}

void simplify(Neurites& all, const Grid& grid, double tolerance_um) {
  constexpr double kReach = 0.25;  // of the tolerance
  Simplifier work(grid, (1 - kReach) * tolerance_um);
  std::vector<bool> gone(all.paths.size(), false);
  double reach_um = 0;
  bool any = false;
  for (std::size_t i = 0; i < all.paths.size(); ++i) {
    const NeuritePath& path = all.paths[i];
    if (!path.attached || path.isBall()) continue;
    const double reach = work.reach(all.points.data() + path.begin, path.count, kReach * tolerance_um);
    if (reach > kReach * tolerance_um) continue;
    reach_um = std::max(reach_um, reach);
    gone[i] = any = true;
  }
  if (any) chargeCarriers(all, gone);
  const bool in_order = inOrder(all.paths);
  std::vector<NeuritePoint> others;
  if (!in_order) others.reserve(all.points.size());
  std::uint32_t written = 0;
  std::size_t left = 0;
  for (std::size_t i = 0; i < all.paths.size(); ++i) {
    if (gone[i]) continue;
    NeuritePath path = all.paths[i];
    const std::uint32_t from = std::exchange(path.begin, written);
    NeuritePoint* to = all.points.data() + written;
    if (!in_order) {
      others.resize(written + path.count);
      to = others.data() + written;
    }
    path.count = static_cast<std::uint32_t>(work.shorten(all.points.data() + from, path.count, to));
    written += path.count;
    all.paths[left++] = path;
  }
  if (!in_order) all.points = std::move(others);
  all.points.resize(written);
  all.paths.resize(left);
  all.error_um += work.largest() + reach_um;
}

void cutOut(Neurites& all, std::span<const std::uint8_t> kept, std::span<std::size_t> bounds) {
  std::size_t pieces = 0;
  for (const NeuritePath& path : all.paths) {
    if (path.isBall()) pieces += kept[path.begin] != 0 ? 1 : 0;
    for (std::uint32_t k = 1; k < path.count; ++k)
      pieces += kept[path.begin + k] != 0 && (k == 1 || kept[path.begin + k - 1] == 0) ? 1 : 0;
  }
  std::vector<NeuritePath> paths;
  paths.reserve(pieces);
  // What is left of a path has no more points than the path: in order, they move down where they are.
  std::vector<NeuritePoint> others;
  if (!inOrder(all.paths)) others.resize(all.points.size());
  NeuritePoint* to = others.empty() ? all.points.data() : others.data();
  std::uint32_t written = 0;
  std::size_t bound = 0;
  for (const NeuritePath& path : all.paths) {
    for (; bound < bounds.size() && &path == all.paths.data() + bounds[bound]; ++bound) bounds[bound] = paths.size();
    const NeuritePoint* from = all.points.data() + path.begin;
    if (path.isBall() && kept[path.begin] != 0) {
      paths.push_back(path);
      paths.back().begin = written;
      to[written++] = from[0];
    }
    for (std::uint32_t k = 1; k < path.count; ++k) {
      if (kept[path.begin + k] == 0) continue;
      if (k == 1 || kept[path.begin + k - 1] == 0) {  // a piece begins
        paths.push_back({path.cell, k == 1 ? path.first_sample : kNoSample, kNoSample, kNoSample, written, 1,
                         k == 1 && path.attached});
        to[written] = from[k - 1];
        to[written++].segments = 0;
      }
      to[written++] = from[k];
      ++paths.back().count;
      if (k + 1 < path.count) continue;
      paths.back().last_sample = path.last_sample;
      if (paths.back().count == path.count) paths.back().lowest = path.lowest;
    }
  }
  for (; bound < bounds.size(); ++bound) bounds[bound] = paths.size();
  if (!others.empty()) all.points = std::move(others);
  all.points.resize(written);
  all.paths = std::move(paths);
}

std::vector<StoredSegment> numbered(const Neurites& all, TileAppearance& appearance) {
  std::vector<std::uint32_t> order(all.paths.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return all.paths[a].cell < all.paths[b].cell; });
  std::vector<StoredSegment> out;
  out.reserve(all.points.size());
  appearance.radii_um.clear();
  appearance.types.clear();
  std::uint32_t cell = UINT32_MAX, fresh = 0;
  for (const std::uint32_t i : order) {
    const NeuritePath& path = all.paths[i];
    if (path.cell != cell) {
      cell = path.cell;
      fresh = 0;
    }
    const std::uint32_t first = fresh++;
    const auto put = [&](const NeuritePoint& point, std::uint32_t child, std::uint32_t parent, const GridPoint& from) {
      out.push_back({{cell, child}, child, parent, point.p, from, true});
      appearance.radii_um.push_back(point.radius_um);
      appearance.types.push_back(point.type);
    };
    const NeuritePoint* points = all.points.data() + path.begin;
    if (path.isBall()) put(points[0], first, first, points[0].p);
    for (std::uint32_t k = 1; k < path.count; ++k) {
      put(points[k], fresh, fresh - 1, points[k - 1].p);
      ++fresh;
    }
  }
  return out;
}

}  // namespace filiform
