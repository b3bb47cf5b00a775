// filiform.h: search.
#include "tools/c/open_set.h"

#include <algorithm>
#include <limits>
#include <span>
#include <string>
#include <unordered_map>

namespace filiform::c {

namespace {

constexpr std::size_t kMostResults = std::size_t{1} << 31;
constexpr unsigned kMostThreads = 256;

Vector3d pointFrom(const double values[3], const char* name) {
  required(values, name);
  return {values[0], values[1], values[2]};
}

NearestQuery queryFrom(const filiform_query& query) {
  NearestQuery asked;
  asked.k = query.k == 0 ? 1 : query.k;
  asked.epsilon = query.epsilon;
  asked.approximate = query.approximate != 0;
  if (query.max_distance_um != 0) asked.max_distance_um = query.max_distance_um;
  return asked;
}

// Turns results into hits. Looks up the sample ids of each cell once.
class HitWriter {
 public:
  explicit HitWriter(OpenSet& set) : set_(set) {}

  filiform_hit operator()(const NearestResult& result, const SearchCounts& counts) {
    filiform_hit hit = hitOf(result.segment, result.p_W, result.t);
    hit.distance_um = result.distance_um;
    hit.exact = result.exact;
    hit.tiles_read = counts.tiles_read;
    return hit;
  }
  filiform_hit operator()(const RayHit& result, const SearchCounts& counts) {
    filiform_hit hit = hitOf(result.segment, result.p_W, result.t);
    hit.distance_um = result.distance_um;
    hit.along_um = result.along_um;
    hit.exact = 1;
    hit.tiles_read = counts.tiles_read;
    return hit;
  }
  template <class Result>
  std::vector<filiform_hit> all(const std::vector<Result>& results, const SearchCounts& counts) {
    std::vector<filiform_hit> hits;
    hits.reserve(results.size());
    set_.files->samples.readAhead(results);
    for (const Result& result : results) hits.push_back((*this)(result, counts));
    return hits;
  }

 private:
  filiform_hit hitOf(SegmentId segment, const Vector3d& p_W, double t) {
    filiform_hit hit{};
    std::copy_n(p_W.data(), 3, hit.point_um);
    hit.t = t;
    hit.cell = segment.cell;
    hit.segment = segment.segment;
    auto& ids = ids_[segment.cell];
    if (!ids) ids = set_.files->samples.cell(segment.cell);
    hit.sample = ids->of(segment.segment);
    return hit;
  }

  OpenSet& set_;
  std::unordered_map<std::uint32_t, std::shared_ptr<const tools::SampleIds::OfCell>> ids_;
};

filiform_hit noHit() {
  filiform_hit hit{};
  hit.distance_um = std::numeric_limits<double>::infinity();
  hit.cell = hit.segment = FILIFORM_NONE;
  return hit;
}

// search(nearest, results) returns what it cost.
template <class Result, class Search>
int callForHits(filiform_set* set, filiform_hit** hits, size_t* count, const Search& search) {
  return call([&] {
    *required(hits, "hits") = nullptr;
    *required(count, "count") = 0;
    const HeldSet held(set, "set");
    std::vector<Result> results;
    const SearchCounts counts = search((*held)->nearest, results);
    const std::vector<filiform_hit> found = HitWriter(**held).all(results, counts);
    *hits = arrayOf(found);
    *count = found.size();
  });
}

}  // namespace

}  // namespace filiform::c

using namespace filiform;
using namespace filiform::c;

extern "C" {

int filiform_nearest(filiform_set* set, const double point_um[3], const filiform_query* query, filiform_hit* hits,
                     size_t* count) {
  return call([&] {
    *required(count, "count") = 0;
    const HeldSet held(set, "set");
    const NearestQuery asked = queryFrom(optionsOr(query, "query"));
    required(hits, "hits");
    std::vector<NearestResult> results;
    const SearchCounts counts = (*held)->nearest.find(pointFrom(point_um, "point_um"), asked, results);
    const std::vector<filiform_hit> found = HitWriter(**held).all(results, counts);
    std::copy(found.begin(), found.end(), hits);
    *count = found.size();
  });
}

int filiform_nearest_many(filiform_set* set, const double* points_um, size_t points, const filiform_query* query,
                          filiform_hit* hits, size_t* counts) {
  return call([&] {
    const HeldSet held(set, "set");
    const filiform_query wanted = optionsOr(query, "query");
    const NearestQuery asked = queryFrom(wanted);
    if (points == 0) return;
    required(points_um, "points_um");
    required(hits, "hits");
    if (points > kMostResults / asked.k) throw UsageError("points: points x k is more than 2^31");
    if (counts != nullptr) std::fill_n(counts, points, 0);
    std::vector<Vector3d> at(points);
    for (std::size_t i = 0; i < points; ++i) at[i] = pointFrom(points_um + 3 * i, "points_um");
    std::vector<std::vector<NearestResult>> found(points);
    std::vector<SearchCounts> costs(points);
    (*held)->nearest.forEach(at, asked, std::clamp(wanted.threads, std::uint32_t{1}, kMostThreads),
                             [&](std::size_t i, std::vector<NearestResult>&& results, const SearchCounts& cost) {
                               found[i] = std::move(results);
                               costs[i] = cost;
                             });
    (*held)->files->samples.readAhead(found);
    HitWriter write(**held);
    for (std::size_t i = 0; i < points; ++i) {
      filiform_hit* const row = hits + i * asked.k;
      for (std::size_t rank = 0; rank < asked.k; ++rank)
        row[rank] = rank < found[i].size() ? write(found[i][rank], costs[i]) : noHit();
      if (counts != nullptr) counts[i] = found[i].size();
    }
  });
}

int filiform_covering_radius(filiform_set* set, double* radius_um) {
  return call([&] {
    *required(radius_um, "radius_um") = 0;
    const HeldSet held(set, "set");
    *radius_um = (*held)->nearest.covering_radius_um();
  });
}

int filiform_within(filiform_set* set, const double point_um[3], double radius_um, filiform_hit** hits, size_t* count) {
  return callForHits<NearestResult>(set, hits, count, [&](const Nearest& nearest, auto& results) {
    return nearest.find(pointFrom(point_um, "point_um"), {.k = SIZE_MAX, .max_distance_um = radius_um}, results);
  });
}

int filiform_box(filiform_set* set, const double lo_um[3], const double hi_um[3], filiform_hit** hits, size_t* count) {
  return callForHits<NearestResult>(set, hits, count, [&](const Nearest& nearest, auto& results) {
    return nearest.inBox(pointFrom(lo_um, "lo_um"), pointFrom(hi_um, "hi_um"), false, results);
  });
}

int filiform_ray(filiform_set* set, const filiform_ray_query* ray, filiform_hit** hits, size_t* count) {
  return callForHits<RayHit>(set, hits, count, [&](const Nearest& nearest, auto& results) {
    sized(ray, "ray");
    RayQuery asked{.origin_W = pointFrom(ray->origin_um, "origin_um"),
                   .direction = pointFrom(ray->direction, "direction")};
    asked.radius_um = ray->radius_um;
    asked.slope = ray->slope;
    if (ray->length_um != 0) asked.length_um = ray->length_um;
    if (ray->most != 0) asked.most = ray->most;
    return nearest.alongRay(asked, results);
  });
}

}  // extern "C"
