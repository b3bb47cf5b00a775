#include "tools/serve/routes/routes.h"

#include "index/text.h"
#include "tools/serve/sets/limits.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <utility>
#include <zlib.h>

namespace filiform::tools {

namespace {

constexpr const char* kPlainText = "text/plain";

const RouteParameter kK{"k", "integer", "find this many segments a point, at most 10000; default: 1"};
const RouteParameter kEpsilon{"epsilon", "number", "allow distances up to (1 + epsilon) times the nearest; default: 0"};
const RouteParameter kOwn{
    "own", "string",
    "no: find no segments of a point's own cell, the one with the segment nearest to the point of all; default: yes"};
const RouteParameter kRadius{"radius", "number", "find only segments within this distance, um; without k up to 10000"};

// Parameters, and those of filters, which nearest, box and ray share.
std::vector<RouteParameter> withFilters(std::vector<RouteParameter> parameters) {
  const std::array<RouteParameter, 5> filters{
      {{"cell", "string", "find only segments of this cell; a part of its name is enough"},
       {"not_cell", "string", "find no segments of this cell"},
       {"type", "string",
        "find only segments of these types: axon,basal,apical,dendrite,soma,undefined or codes of SWC"},
       {"where", "string",
        "find only segments of cells whose attribute meets NAME=VALUE, !=, <, <=, > or >=; ; between several"},
       {"cells", "boolean", "find cells, each by its first segment; k counts cells; default: false"}}};
  parameters.insert(parameters.end(), filters.begin(), filters.end());
  return parameters;
}

const RouteParameter kName{
    "name", "string",
    "only cells whose whole name matches; * stands for any text, ? for any byte; letter case does not count"};
const RouteParameter kWhere{
    "where", "string",
    "only cells that meet all conditions, such as layer>=4;mtype=L5_*;measure:tips>20, as cells --where does"};
const RouteParameter kCursor{"cursor", "string",
                             "continue a list: the cursor of its last answer; start: from the beginning"};

const RouteParameter kPart{"cursor", "string", "answer in parts: start, then the cursor of the last answer"};

const RouteParameter kVersion{"v", "string", "the version that the page states; the browser then keeps the file"};

const RouteParameter kRevision{"revision", "string", "the revision of the set that the client has open"};

const std::vector<Route>& routeTable() {
  static const std::vector<Route> kRoutes{
      {"GET",
       "/",
       "A page of the sets for browsers",
       "text/html",
       {{"token", "string", "the server's token; answers with a cookie and a redirect"}},
       false,
       pageAnswer},
      {"GET", "/page.css", "The style of the page", "text/css", {}, true, styleAnswer},
      {"GET", "/page.js", "The script of the page", "text/javascript", {}, true, scriptAnswer},
      {"GET", "/icon.svg", "The icon of the page", "image/svg+xml", {}, true, iconAnswer},
      {"GET",
       "/travel/{set}",
       "A page in which the browser travels through the set",
       "text/html",
       {{"budget", "integer", "keep at most this memory of tiles in the browser, MiB; default: 96"},
        {"segments", "integer", "draw at most this many segments; default: by the renderer"},
        {"desk", "string", "look on at the desk of this name"},
        {"token", "string", "the server's token; answers with a cookie and a redirect"}},
       false,
       travelAnswer},
      {"GET",
       "/travel/page/travel.js",
       "The script of this page",
       "text/javascript",
       {kVersion},
       true,
       travelFileAnswer},
      {"GET", "/travel/page/travel.css", "The style of this page", "text/css", {kVersion}, true, travelFileAnswer},
      {"GET",
       "/travel/page/reader.js",
       "The worker of this page that reads",
       "text/javascript",
       {kVersion},
       true,
       travelFileAnswer},
      {"GET",
       "/travel/page/filiform.js",
       "The program of this page",
       "text/javascript",
       {kVersion},
       true,
       travelFileAnswer},
      {"GET",
       "/travel/page/filiform.worker.js",
       "The same for its threads",
       "text/javascript",
       {kVersion},
       true,
       travelFileAnswer},
      {"GET",
       "/travel/page/filiform.wasm",
       "The same in WebAssembly",
       "application/wasm",
       {kVersion},
       true,
       travelFileAnswer},
      {"GET", "/healthz", "200 while the server runs", kPlainText, {}, true, healthAnswer},
      {"GET",
       "/readyz",
       "200 while a set is readable; the text counts those in their newest revision",
       kPlainText,
       {},
       true,
       readinessAnswer},
      {"GET", "/metrics", "Counters and gauges in Prometheus text", kPlainText, {}, false, metricsAnswer},
      {"GET", "/v1/openapi.json", "This description", kJsonType, {}, false, openapiAnswer},
      {"GET", "/v1/sets", "The sets", kJsonType, {}, false, setsAnswer},
      {"GET", "/v1/sets/{set}", "A set, as info --json prints it", kJsonType, {}, false, setAnswer},
      {"GET", "/v1/sets/{set}/files/CURRENT", "The name of the set's revision", kPlainText, {}, false, fileAnswer},
      {"GET",
       "/v1/sets/{set}/files/{revision}/{file}",
       "A file of a revision; Range gives a part",
       kBytesType,
       {},
       false,
       fileAnswer},
      {"GET",
       "/v1/sets/{set}/files/{revision}/{file}/{range}",
       "The bytes FIRST-LAST of a file, under their own address",
       kBytesType,
       {},
       false,
       fileAnswer},
      {"GET", "/v1/sets/{set}/nearest", "The segments nearest to a point", kJsonType,
       withFilters({{"at", "string", "X,Y,Z, um"}, kK, kEpsilon, kRadius, kOwn}), false, nearestAnswer},
      {"POST", "/v1/sets/{set}/nearest", "The segments nearest to each of many points", kJsonType,
       withFilters({kK, kEpsilon, kRadius, kOwn, kPart}), false, nearestAnswer},
      {"GET", "/v1/sets/{set}/box", "The segments that meet a box, nearest to its middle first", kJsonType,
       withFilters({{"lo", "string", "X,Y,Z, um: the lower corner"},
                    {"hi", "string", "X,Y,Z, um: the upper corner"},
                    {"limit", "integer", "give at most this many rows, at most 1000000; default: 10000"},
                    kPart}),
       false, boxAnswer},
      {"GET", "/v1/sets/{set}/ray", "The segments along a ray, the first along it first", kJsonType,
       withFilters({{"from", "string", "X,Y,Z, um"},
                    {"direction", "string", "X,Y,Z of any length except 0"},
                    {"k", "integer", "give at most this many rows, at most 10000; default: 1"},
                    {"tolerance", "number", "largest distance from the ray, um; default: 1"},
                    {"slope", "number", "increase of the tolerance for each um along the ray; default: 0"},
                    {"length", "number", "find only segments within this distance along the ray, um"}}),
       false, rayAnswer},
      {"GET",
       "/v1/sets/{set}/path",
       "The path along a cell between two places",
       kJsonType,
       {{"from", "string",
         "CELL:soma, CELL:ID, CELL:ID+T towards the sample's parent, CELL:X,Y,Z, or CELL:sectionN+POS; a part of a "
         "name is enough"},
        {"to", "string", "the same, on the same cell; or tip, for the tip that is farthest along the cell"}},
       false,
       pathAnswer},
      {"GET",
       "/v1/sets/{set}/cells",
       "The cells, up to 1000 at once",
       kJsonType,
       {kName, kWhere, kCursor},
       false,
       cellsAnswer},
      {"GET",
       "/v1/sets/{set}/cells/{cell}",
       "A cell with its samples: NAME.json, NAME.swc or NAME.npy",
       kJsonType,
       {},
       false,
       cellAnswer},
      {"GET",
       "/v1/sets/{set}/measures",
       "Measures of cells: rows of the table of filiform measure, of up to 1000 cells at once",
       kJsonType,
       {{"per", "string", "give a row for each cell, neurite, branch or type; default: cell"},
        {"features", "string", "give these features, with commas between; all: all; default: eleven usual ones"},
        {"type", "string", "measure only neurites of these types: axon, basal, apical, or codes of SWC"},
        {"sholl", "number", "count crossings with spheres about the soma, every so many um"},
        kName,
        kWhere,
        kCursor},
       false,
       measuresAnswer},
      {"GET",
       "/v1/sets/{set}/contacts",
       "Where a cell comes close to others: rows of the table of filiform contacts",
       kJsonType,
       {{"cell", "string", "the first cell; a part of a name is enough"},
        {"within", "number", "find what lies at most this far apart, um; default: 2"},
        {"types", "string", "TYPE,TYPE: take only segments of these types, of the first and of the second cell"},
        {"surface", "boolean", "true: measure between surfaces, not axes; an unknown radius counts 0"},
        {"limit", "integer", "give at most this many rows, at most 100000; default: 10000"},
        kWhere},
       false,
       contactsAnswer},
      {"GET",
       "/v1/sets/{set}/density",
       "The length of neurites in each box of a grid, um, and um per um3",
       kJsonType,
       {{"step", "number", "edge of the boxes, um; needed"},
        {"type", "string", "count only segments of these types: axon, basal, apical, or codes of SWC"},
        kWhere},
       false,
       densityAnswer},
      {"GET", "/v1/session", "A WebSocket for a session, filiform.v1", kJsonType, {}, false, sessionAnswer},
      {"GET",
       "/v1/sets/{set}/desks/{desk}",
       "A WebSocket by which a desk shows its place",
       kJsonType,
       {kRevision},
       false,
       deskAnswer},
      {"GET",
       "/v1/sets/{set}/desks/{desk}/page",
       "A WebSocket by which a page looks on",
       kJsonType,
       {kRevision},
       false,
       deskAnswer},
      {"GET",
       "/v1/sets/{set}/picture",
       "A picture of the set",
       "image/png",
       {{"camera", "string", "front, back, left, right, top, bottom, YAW,PITCH in degrees, or X,Y,Z:X,Y,Z in um"},
        {"size", "string", "WIDTHxHEIGHT, at most 2048x2048; default: 640x400"}},
       false,
       pictureAnswer},
      {"GET",
       "/v1/capability",
       "The part of the addresses of /precomputed and /catmaid that stands for the token",
       kJsonType,
       {},
       false,
       capabilityAnswer},
      {"DELETE",
       "/v1/capability",
       "Revokes the capability; answers with a new one",
       kJsonType,
       {},
       false,
       capabilityAnswer},
      {"GET",
       "/precomputed/{set}/info",
       "Neuroglancer: how the skeletons are stored",
       kJsonType,
       {},
       false,
       precomputedInfoAnswer},
      {"GET",
       "/precomputed/{set}/segment_properties/info",
       "Neuroglancer: numbers and names of the cells",
       kJsonType,
       {},
       false,
       precomputedPropertiesAnswer},
      {"GET",
       "/precomputed/{set}/{skeleton}",
       "Neuroglancer: the skeleton of a cell, by its number",
       kBytesType,
       {},
       false,
       precomputedSkeletonAnswer},
      {"GET",
       "/catmaid/{set}/accounts/anonymous-api-token",
       "CATMAID: a token that opens nothing",
       kJsonType,
       {},
       false,
       catmaidTokenAnswer},
      {"GET",
       "/catmaid/{set}/version",
       "CATMAID: the version of its interface",
       kJsonType,
       {},
       false,
       catmaidVersionAnswer},
      {"GET", "/catmaid/{set}/1/stacks", "CATMAID: the stacks, one", kJsonType, {}, false, catmaidStacksAnswer},
      {"GET",
       "/catmaid/{set}/1/stack/1/info",
       "CATMAID: box and levels of detail, nm",
       kJsonType,
       {},
       false,
       catmaidStackAnswer},
      {"GET",
       "/catmaid/{set}/1/skeletons/",
       "CATMAID: the ids of the skeletons",
       kJsonType,
       {},
       false,
       catmaidSkeletonsAnswer},
      {"GET",
       "/catmaid/{set}/1/node/list",
       "CATMAID: the nodes of a box, nm",
       kJsonType,
       {{"left", "number", "the lowest x"},
        {"top", "number", "the lowest y"},
        {"z1", "number", "the lowest z"},
        {"right", "number", "the highest x"},
        {"bottom", "number", "the highest y"},
        {"z2", "number", "the highest z"},
        {"lod_type", "string", "percent: lod is from 0, coarsest, to 1; absolute: lod counts the levels from 0"},
        {"lod", "number", "level of detail; default: full resolution"},
        {"format", "string", "without effect: the answer is JSON"},
        {"src", "string", "without effect"}},
       false,
       catmaidNodesAnswer},
      {"GET",
       "/catmaid/{set}/1/skeletons/{skeleton}/compact-detail",
       "CATMAID: all nodes of a skeleton, nm",
       kJsonType,
       {{"with_tags", "string", "without effect"}, {"with_history", "string", "without effect"}},
       false,
       catmaidSkeletonAnswer},
      {"GET",
       "/catmaid/{set}/1/skeletons/{skeleton}/root",
       "CATMAID: the root of a skeleton, nm",
       kJsonType,
       {},
       false,
       catmaidRootAnswer},
      // The layout of the set's folder, as on a server of files.
      {"GET", "/v1/sets/{set}/CURRENT", "As files/CURRENT", kPlainText, {}, false, fileAnswer},
      {"GET", "/v1/sets/{set}/{revision}/{file}", "As files/{revision}/{file}", kBytesType, {}, false, fileAnswer}};
  return kRoutes;
}

std::vector<std::string> partsOf(std::string_view path) {
  std::vector<std::string> parts;
  path.remove_prefix(1);
  for (;;) {
    const std::size_t slash = path.find('/');
    parts.emplace_back(path.substr(0, slash));
    if (slash == std::string_view::npos) return parts;
    path.remove_prefix(slash + 1);
  }
}

const std::vector<std::vector<std::string>>& routeParts() {
  static const std::vector<std::vector<std::string>> kParts = [] {
    std::vector<std::vector<std::string>> all;
    for (const Route& route : routeTable()) all.push_back(partsOf(route.path));
    return all;
  }();
  return kParts;
}

bool fits(const std::vector<std::string>& pattern, const std::vector<std::string>& parts,
          std::vector<std::string>& captured) {
  if (pattern.size() != parts.size()) return false;
  captured.clear();
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (pattern[i].starts_with('{'))
      captured.push_back(parts[i]);
    else if (pattern[i] != parts[i])
      return false;
  }
  return true;
}

bool sameMethod(const std::string& asked, const char* offered) {
  return asked == offered || (asked == "HEAD" && std::string_view(offered) == "GET");
}

void checkParameters(const Route& route, const Request& request) {
  for (const auto& [name, value] : request.parameters) {
    bool known = false;
    for (const RouteParameter& parameter : route.parameters) known = known || name == parameter.name;
    if (known) continue;
    std::string names;
    for (const RouteParameter& parameter : route.parameters) (names += names.empty() ? "" : ", ") += parameter.name;
    throw Refusal(400, "unknown parameter '" + escaped(name, 40) + "'; " +
                           (names.empty() ? "this route has none" : "known are " + names));
  }
}

// The tag of an answer about a set: the same revision answers the same question with the same bytes. The version of the
// program is part of it. Empty: the answer has none.
std::string tagOf(const Call& call) {
  const Request& request = call.request;
  if (call.served == nullptr || (request.method != "GET" && request.method != "HEAD") || request.parts[0] == "travel")
    return {};
  const auto add = [](std::uint64_t hash, std::string_view text) {
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    return (hash ^ 0xffu) * 0x100000001b3u;
  };
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const std::string_view text :
       {std::string_view(call.service.version), std::string_view(request.target), request.header("accept")})
    hash = add(hash, text);
  char text[24];
  std::snprintf(text, sizeof text, "-%016llx", static_cast<unsigned long long>(hash));
  return call.served->set().revision() + text;
}

// Caches ask whether the answer is still that of the newest revision.
Answer tagged(Answer answer, const std::string& tag, bool is_private) {
  answer.headers.emplace_back("ETag", "W/\"" + tag + '"');
  answer.headers.emplace_back("Cache-Control", is_private ? "private, no-cache" : "public, no-cache");
  answer.headers.emplace_back("Vary", "Accept, Accept-Encoding");
  return answer;
}

// Text of more than 1 KiB as gzip, for a client that takes it. Not parts, nor what has a tag of its very bytes. If the
// time for the answer is over, it stays as it is.
void compress(Answer& answer) {
  constexpr std::size_t kLeast = 1024, kPiece = std::size_t{1} << 20;
  const bool is_text = answer.type.starts_with("text/") || answer.type.find("json") != std::string::npos;
  if (answer.status != 200 || answer.header("ETag").starts_with('"')) return;
  if (!is_text || answer.file || answer.body.size() < kLeast || !answer.header("Content-Encoding").empty()) return;
  z_stream stream{};
  constexpr int kGzip = 16 + 15, kMemory = 8;
  if (::deflateInit2(&stream, Z_BEST_SPEED, Z_DEFLATED, kGzip, kMemory, Z_DEFAULT_STRATEGY) != Z_OK) return;
  const std::unique_ptr<z_stream, int (*)(z_stream*)> ends(&stream, ::deflateEnd);
  std::string packed(::deflateBound(&stream, answer.body.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(answer.body.data());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());  // at most 256 MiB
  for (std::size_t left = answer.body.size(); left > 0;) {
    if (TimedStore::isOver()) return;
    const std::size_t piece = std::min(left, kPiece);
    left -= piece;
    stream.avail_in = static_cast<uInt>(piece);
    ::deflate(&stream, left == 0 ? Z_FINISH : Z_NO_FLUSH);
  }
  packed.resize(stream.total_out);
  packed.shrink_to_fit();
  answer.body = std::move(packed);
  answer.headers.emplace_back("Content-Encoding", "gzip");
  if (answer.header("Vary").empty()) answer.headers.emplace_back("Vary", "Accept-Encoding");
}

}  // namespace

std::span<const Route> allRoutes() { return routeTable(); }

struct Routes::Found {
  const Route* route = nullptr;      // nullptr: no route has the path and the method
  const Route* same_path = nullptr;  // a route of the path
  std::string methods = {};          // of the path, for Allow
  std::vector<std::string> captured = {};
};

Routes::Routes(const Service& service, std::function<void(const std::string& line)> log)
    : service_(service), log_(std::move(log)) {}

Routes::Found Routes::find(Request& request) const {
  Found found;
  request.parts.clear();
  request.parameters.clear();
  request.capability.reset();
  request.parseTarget();
  if (service_.access.needsToken() && request.parts.size() > 1 &&
      (request.parts[0] == "precomputed" || request.parts[0] == "catmaid") && request.parts[1].starts_with('~')) {
    request.capability = request.parts[1].substr(1);
    request.parts.erase(request.parts.begin() + 1);
  }
  std::vector<std::string> captured;
  for (std::size_t i = 0; i < routeTable().size(); ++i) {
    const Route& route = routeTable()[i];
    // Only routes of one path are alternatives to each other.
    if (found.same_path != nullptr && std::string_view(found.same_path->path) != route.path) continue;
    if (!fits(routeParts()[i], request.parts, captured)) continue;
    found.same_path = &route;
    found.methods += std::string(found.methods.empty() ? "" : ", ") + route.method;
    if (std::string_view(route.method) == "GET") found.methods += ", HEAD";
    if (!sameMethod(request.method, route.method)) continue;
    found.route = &route;
    found.captured = captured;
  }
  return found;
}

Routed Routes::finished(const Request& request, Answer answer, const char* route) const {
  if (answer.header("Cache-Control").empty()) answer.headers.emplace_back("Cache-Control", "no-store");
  service_.access.addCors(request, answer);
  return {std::move(answer), route};
}

Routed Routes::refusedToken(const Request& request, Answer answer, const char* route) const {
  if (answer.status == 401 || answer.status == 429) ++service_.metrics.refused_tokens;
  return finished(request, std::move(answer), route);
}

std::optional<Routed> Routes::refuse(Request& head) const {
  const char* path = "";
  try {
    if (head.target.size() > limits::kTargetBytes) throw Refusal(400, "the URL is longer than 8 KiB");
    const Found found = find(head);
    if (found.same_path != nullptr) path = found.same_path->path;
    const bool takes_token = found.route != nullptr &&
                             std::any_of(found.route->parameters.begin(), found.route->parameters.end(),
                                         [](const RouteParameter& p) { return std::string_view(p.name) == "token"; });
    const bool brings_token = takes_token && head.parameters.contains("token");
    // Before the set is looked for, so that names of sets cannot be tried without a token.
    if (brings_token && service_.access.needsToken() && !service_.access.isToken(head.parameters.at("token")))
      return refusedToken(head, service_.access.wrongToken(head), path);
    if (auto refusal = service_.access.refuse(head, (found.route != nullptr && found.route->open) || brings_token))
      return refusedToken(head, std::move(*refusal), path);
    if (found.same_path == nullptr) {
      const bool slash = head.target.find("/cells/") != std::string::npos;
      throw Refusal(404, std::string("no such resource; /v1/openapi.json lists them") +
                             (slash ? "; a '/' in the name of a cell is written %2F" : ""));
    }
    if (head.method == "OPTIONS" || found.route == nullptr) {
      Answer answer = head.method == "OPTIONS" ? Answer{.status = 204} : problem(405, "allowed here: " + found.methods);
      answer.headers.emplace_back("Allow", found.methods);
      return finished(head, std::move(answer), path);
    }
    checkParameters(*found.route, head);
    const std::string_view encoding = head.header("content-encoding");
    if (!encoding.empty() && encoding != "identity")
      throw Refusal(415, "send the body without Content-Encoding; compressed bodies are not read");
  } catch (const Refusal& refusal) {
    return finished(head, problem(refusal.status(), refusal.what()), path);
  }
  return std::nullopt;
}

bool Routes::isShort(const Request& request) {
  const auto is = [path = std::string_view(request.target)](std::string_view name) {
    return path.starts_with(name) && (path.size() == name.size() || path[name.size()] == '?');
  };
  return is("/healthz") || is("/readyz") || is("/metrics");
}

Routed Routes::answer(Request& request, const std::atomic<bool>* left) const {
  if (auto refused = refuse(request)) return std::move(*refused);
  const Found found = find(request);
  const char* const path = found.route->path;
  const auto failed = [&](unsigned status, const std::string& detail, const std::string& line = "") {
    if (!line.empty()) log_(line);
    return finished(request, problem(status, detail), path);
  };
  try {
    const TimedStore::Limit limit(limits::kQuery_s, left);
    Call call{service_, request, found.captured};
    if (!found.captured.empty()) {  // the first is always a set
      call.served = service_.shelf.find(found.captured.front());
      if (call.served == nullptr && service_.shelf.has(found.captured.front()))
        throw Refusal(503, "this set cannot be read now; the server's log says why");
      if (call.served == nullptr)
        throw Refusal(404, "no set has the name '" + escaped(found.captured.front(), 80) + "'; /v1/sets lists them");
    }
    const std::string tag = tagOf(call);
    const bool any_tag = request.header("if-none-match") == "*";
    if (!tag.empty() && !any_tag && hasTag(request.header("if-none-match"), tag))
      return finished(request, tagged({.status = 304}, tag, service_.access.needsToken()), path);
    Answer answer = found.route->answer(call);
    if (!tag.empty() && answer.status == 200 && answer.header("Cache-Control").empty())
      answer = tagged(any_tag ? Answer{.status = 304} : std::move(answer), tag, service_.access.needsToken());
    if (request.takesGzip()) compress(answer);
    return finished(request, std::move(answer), path);
  } catch (const Refusal& refusal) {
    return failed(refusal.status(), refusal.what());
  } catch (const UsageError& error) {
    return failed(400, error.what());
  } catch (const std::bad_alloc&) {
    return failed(503, "the server is out of memory for now; ask for less", "out of memory");
  } catch (const std::exception& error) {
    ++service_.metrics.unreadable;
    return failed(500, "the set cannot be read; the server's log says why", error.what());
  }
}

}  // namespace filiform::tools
