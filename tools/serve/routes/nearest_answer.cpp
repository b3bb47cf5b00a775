// The answers of the routes nearest, box and ray.
#include "tools/serve/routes/cursor.h"
#include "tools/serve/routes/point_list.h"
#include "tools/serve/routes/segment_rows.h"
#include "tools/serve/routes/service.h"
#include "tools/serve/sets/limits.h"
#include "tools/words/filter_words.h"
#include "tools/words/npy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <utility>

namespace filiform::tools {

namespace {

constexpr std::size_t kAtOnce = 4096;       // points between two looks at the clock
constexpr std::size_t kPartAtOnce = 64;     // the same, in a part
constexpr std::size_t kPartRows = 100'000;  // of a part, or those of the last points a few more
constexpr double kPartTime = 0.5;           // share of an answer's time after which a part ends

// What the parameters ask for; `limited`: k is the service's own limit.
struct NearestAsked {
  std::vector<Vector3d> points;
  NearestQuery query;
  bool limited = false;
};

// A whole number of a JSON body.
std::size_t wholeOf(const std::string& name, double value, std::size_t most) {
  if (!(value >= 1 && value <= static_cast<double>(most)) || value != std::floor(value))
    throw Refusal(400, name + " must be a whole number from 1 to " + std::to_string(most));
  return static_cast<std::size_t>(value);
}

// Points and parameters of a request; a member of a JSON body stands for the parameter of its name.
NearestAsked askedOf(const Request& request) {
  NearestAsked asked;
  std::optional<double> radius = request.number("radius"), epsilon = request.number("epsilon");
  std::optional<std::size_t> k = request.whole("k", 1, limits::kNeighbours);
  if (request.method != "POST") {
    const auto at = request.parameter("at");
    if (!at) throw Refusal(400, "give at=X,Y,Z, um; or POST many points");
    const std::vector<double> c = parseNumbers("at", *at, 3);
    asked.points.emplace_back(c[0], c[1], c[2]);
  } else if (request.header("content-type").starts_with(kNpyType)) {
    asked.points = readNpyPoints(request.body, limits::kPoints);
  } else if (request.header("content-type").starts_with(kJsonType)) {
    PointList list = readPointList(request.body, limits::kPoints);
    asked.points = std::move(list.points);
    for (const auto& [name, value] : list.numbers) {
      if (request.parameter(name)) throw Refusal(400, name + " is given in the URL and in the body");
      if (name == "k")
        k = wholeOf("k", value, limits::kNeighbours);
      else if (name == "epsilon")
        epsilon = value;
      else if (name == "radius")
        radius = value;
      else
        throw Refusal(400, "the body has an unknown member; known are points, k, epsilon, radius");
    }
  } else {
    throw Refusal(415, "send points as application/json or application/x-npy, named in Content-Type");
  }
  asked.query.epsilon = epsilon.value_or(0);
  if (radius) asked.query.max_distance_um = *radius;
  asked.limited = radius && !k;
  asked.query.k = k.value_or(radius ? limits::kNeighbours : 1);
  return asked;
}

Vector3d pointOf(const std::vector<double>& numbers, std::size_t first) {
  return {numbers[first], numbers[first + 1], numbers[first + 2]};
}

// The search in the segments that the parameters name.
std::shared_ptr<const Nearest> searchOf(const Call& call) {
  const ServedSet& served = *call.served;
  const Request& request = call.request;
  FilterParts parts;
  if (const auto name = request.parameter("cell")) parts.cells.push_back(cellLike(served, *name, "cell"));
  if (const auto name = request.parameter("not_cell")) parts.not_cells.push_back(cellLike(served, *name, "not_cell"));
  if (const auto types = request.parameter("type")) parts.types = parseSegmentTypes(*types, ',', "type");
  if (const auto conditions = request.parameter("where")) parts.met = cellsMeeting(served, *conditions);
  const SegmentFilter filter = filterOf(served.set().cell_count(), std::move(parts));
  if (filter.takesAll()) return {call.served, &served.nearest()};
  return served.filtered().with(filter);
}

bool wantsCells(const Request& request) { return request.isFirst("cells", "true", "false"); }

// Limits the rows of an answer; `limit` is the request's, if it gives one.
std::size_t rowLimit(const Request& request) { return request.whole("limit", 1, limits::kRows).value_or(10'000); }

}  // namespace

bool wantsNpy(const Request& request) { return request.header("accept").find(kNpyType) != std::string_view::npos; }

Answer nearestAnswer(const Call& call) {
  const NearestAsked asked = askedOf(call.request);
  if (asked.points.size() * (asked.limited ? 1 : asked.query.k) > limits::kRows)
    throw Refusal(413, "points times k exceed " + std::to_string(limits::kRows) + "; send fewer points or a smaller k");
  const auto part = call.request.method == "POST" ? cursorOf(call, 1) : std::nullopt;
  SegmentRows rows(*call.served, wantsNpy(call.request), false);
  NearestQuery query = asked.query;
  query.of_cells = wantsCells(call.request);
  query.other_cells = call.request.isFirst("own", "no", "yes");
  const std::shared_ptr<const Nearest> search = searchOf(call);
  if (asked.limited) ++query.k;  // one more shows that there are more
  // With large k, few points at once, so that their results need little memory; in parts too, whose time may end.
  const std::size_t at_once = std::clamp<std::size_t>(limits::kRows / 10 / query.k, 1, part ? kPartAtOnce : kAtOnce);
  const std::size_t first = part ? std::min<std::uint64_t>(part->front(), asked.points.size()) : 0;
  for (std::size_t begin = first; begin < asked.points.size(); begin += at_once) {
    if (part && begin > first && (rows.size() >= kPartRows || TimedStore::isOver(kPartTime))) {
      rows.continueAt(cursorText(call, {begin}));
      return rows.take();
    }
    TimedStore::check();
    const auto some = std::span(asked.points).subspan(begin, std::min(at_once, asked.points.size() - begin));
    std::size_t i = begin;
    std::vector<std::vector<NearestResult>> found(some.size());
    search->forEach(some, query, 1, [&](std::size_t at, std::vector<NearestResult>&& results, const SearchCounts&) {
      TimedStore::check();
      found[at] = std::move(results);
    });
    call.served->sampleIds().readAhead(found);
    const std::vector<SegmentLook> looks = call.served->looks().of(found);
    const SegmentLook* look = looks.data();
    for (const std::vector<NearestResult>& results : found) {
      const std::size_t sent = std::min(results.size(), asked.query.k);
      for (std::size_t r = 0; r < sent; ++r) rows.add(i, results[r], look[r]);
      look += results.size();
      if (sent < results.size()) rows.truncate();
      ++i;
    }
  }
  if (part) rows.continueAt(std::nullopt);
  return rows.take();
}

Answer boxAnswer(const Call& call) {
  const auto lo = call.request.parameter("lo"), hi = call.request.parameter("hi");
  if (!lo || !hi) throw Refusal(400, "give the box as lo=X,Y,Z and hi=X,Y,Z, um");
  const Vector3d lo_W = pointOf(parseNumbers("lo", *lo, 3), 0), hi_W = pointOf(parseNumbers("hi", *hi, 3), 0);
  const std::size_t most = rowLimit(call.request);
  const auto part = cursorOf(call, 2);
  if (part && wantsCells(call.request))
    throw Refusal(400, "cells=true is answered whole, without cursor: each cell once, by its first segment of all");
  if (!part && call.served->segmentsAround(lo_W, hi_W) > limits::kBoxSegments)
    throw Refusal(413, "the tiles that the box meets hold more than " + std::to_string(limits::kBoxSegments) +
                           " segments; ask in parts, with cursor=start, or for smaller boxes");
  SegmentRows rows(*call.served, wantsNpy(call.request), false);
  std::vector<NearestResult> found;
  if (part) {
    constexpr std::uint64_t kEnd = UINT32_MAX;
    const BoxPlace from{static_cast<std::uint32_t>(std::min(part->at(0), kEnd)),
                        static_cast<std::uint32_t>(std::min(part->at(1), kEnd))};
    BoxPart box = searchOf(call)->partOfBox(lo_W, hi_W, from, std::min(most, kPartRows),
                                            [] { return TimedStore::isOver(kPartTime); });
    found = std::move(box.results);
    rows.continueAt(box.next ? std::optional(cursorText(call, {box.next->tile, box.next->hit})) : std::nullopt);
  } else {
    found = searchOf(call)->inBox(lo_W, hi_W, wantsCells(call.request));
    if (found.size() > most)
      rows.truncate(), found.erase(found.begin() + static_cast<std::ptrdiff_t>(most), found.end());
  }
  call.served->sampleIds().readAhead(found);
  const std::vector<SegmentLook> looks = call.served->looks().of(found);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (i % kAtOnce == 0) TimedStore::check();
    rows.add(0, found[i], looks[i]);
  }
  return rows.take();
}

Answer rayAnswer(const Call& call) {
  const auto from = call.request.parameter("from"), direction = call.request.parameter("direction");
  if (!from || !direction) throw Refusal(400, "give the ray as from=X,Y,Z (um) and direction=X,Y,Z");
  const std::size_t most = call.request.whole("k", 1, limits::kNeighbours).value_or(1);
  RayQuery ray{.origin_W = pointOf(parseNumbers("from", *from, 3), 0),
               .direction = pointOf(parseNumbers("direction", *direction, 3), 0),
               .radius_um = call.request.number("tolerance").value_or(1),
               .slope = call.request.number("slope").value_or(0),
               .length_um = call.request.number("length").value_or(std::numeric_limits<double>::infinity()),
               .most = most + 1,  // one more shows that there are more
               .of_cells = wantsCells(call.request)};
  SegmentRows rows(*call.served, wantsNpy(call.request), true);
  std::vector<RayHit> hits = searchOf(call)->alongRay(ray);
  if (hits.size() > most) rows.truncate(), hits.pop_back();
  call.served->sampleIds().readAhead(hits);
  const std::vector<SegmentLook> looks = call.served->looks().of(hits);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const RayHit& hit = hits[i];
    const auto rank = static_cast<std::uint32_t>(i);
    const NearestResult result{rank, hit.distance_um, hit.p_W, hit.segment, hit.t, hit.tile, true};
    rows.add(0, result, looks[i], hit.along_um);
  }
  return rows.take();
}

}  // namespace filiform::tools
