// The page of the service, its style and its script.
#include "tools/serve/routes/html.h"
#include "tools/serve/routes/service.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <cmath>

namespace filiform::tools {

namespace {

constexpr const char* kPolicy =
    "default-src 'none'; style-src 'self'; script-src 'self'; img-src 'self'; base-uri 'none'; form-action 'none'";

// What the page needs of the request and the server.
struct PageContext {
  std::string server;  // such as http://host:7878
  std::string doors;   // "" or "/~CAPABILITY"
  bool token = false;
  bool pictures = false;
  std::string neuroglancer;
};

std::string code(const std::string& text) { return "<pre>" + htmlText(text) + "</pre>\n"; }

std::string middleOf(const ServedSet& served) {
  const GridBox& box = served.set().bounds();
  if (box.empty()) return "0,0,0";
  const Vector3d lo = served.set().grid().toWorld(box.lo), hi = served.set().grid().toWorld(box.hi);
  std::string at;
  for (int axis = 0; axis < 3; ++axis)
    at += (axis == 0 ? "" : ",") + formatNumber(std::round((lo[axis] + hi[axis]) / 2));
  return at;
}

// Bytes that are special in a URL's fragment, as %XX.
std::string fragmentText(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (std::string_view("{}[]\":,/.-_~!").find(c) != std::string_view::npos)
      safe += c;
    else
      safe += urlPart(std::string(1, c));
  }
  return safe;
}

// The state of a Neuroglancer that shows the first cells of the set.
std::string neuroglancerState(const ServedSet& served, const std::string& source) {
  constexpr std::uint32_t kCells = 100;
  constexpr std::uint64_t kSamples = 500'000;
  nlohmann::ordered_json segments = nlohmann::ordered_json::array();
  std::uint64_t samples = 0;
  for (std::uint32_t cell = 0; cell < std::min(served.store().cell_count(), kCells); ++cell) {
    const CellRecord& record = served.store().cell(cell);
    if (record.removed || (samples += record.samples) > kSamples) continue;
    segments.push_back(std::to_string(served.cellNumbers().of(cell)));
  }
  const GridBox& box = served.set().bounds();
  Vector3d lo_nm = Vector3d::Zero(), hi_nm = Vector3d::Zero();
  if (!box.empty()) {
    lo_nm = served.set().grid().toWorld(box.lo) * 1e3;
    hi_nm = served.set().grid().toWorld(box.hi) * 1e3;
  }
  const Vector3d middle = ((lo_nm + hi_nm) / 2).array().round();
  const nlohmann::ordered_json nm{1e-9, "m"};
  return jsonText(
      {{"dimensions", {{"x", nm}, {"y", nm}, {"z", nm}}},
       {"position", {middle.x(), middle.y(), middle.z()}},
       {"projectionScale", std::max(1.0, std::round(1.2 * (hi_nm - lo_nm).maxCoeff()))},
       {"layers", nlohmann::ordered_json::array({nlohmann::ordered_json{{"type", "segmentation"},
                                                                        {"name", served.name()},
                                                                        {"source", source},
                                                                        {"segments", std::move(segments)}}})},
       {"showSlices", false},
       {"layout", "3d"}});
}

std::string sectionOf(const ServedSet& served, const PageContext& page) {
  const SetCounts& n = served.set().counts();
  const std::string name = urlPart(served.name()), path = "/v1/sets/" + name;
  std::string html = "<h2>" + htmlText(served.name()) + "</h2>\n";
  if (page.pictures)
    html += "<a href=\"" + path + "/picture?size=1600x1000\"><img src=\"" + path +
            "/picture?size=640x400\" width=\"640\" height=\"400\" loading=\"lazy\" alt=\"picture of " +
            htmlText(served.name()) + "\"></a>\n";
  html += "<table>";
  const auto row = [&html](const char* what, const std::string& figure) {
    html += std::string("<tr><th>") + what + "<td>" + htmlText(figure) + "\n";
  };
  row("cells", formatCount(n.cells));
  row("segments", formatCount(n.segments));
  row("tiles", formatCount(n.tiles));
  row("levels of detail", served.levels() != nullptr ? counted(served.levels()->size(), "tile") : "none");
  row("on disk", formatBytes(served.set().bytes()));
  row("revision", served.set().revision());
  html += "</table>\n";

  const std::string set = page.server + path;
  const std::string token_file = page.token ? " --token-file TOKEN_FILE" : "";
  html += "<h3>Program</h3>\n" + code("filiform view " + set + token_file + "\nfiliform nearest " + set + " " + [&] {
            std::string blanks = middleOf(served);
            std::replace(blanks.begin(), blanks.end(), ',', ' ');
            return blanks;
          }() + token_file);
  html += "<h3>Browser</h3>\n<p><a href=\"/travel/" + name + "\">travel</a> &middot; <a href=\"" + path +
          "\">figures</a> &middot; <a href=\"" + path + "/cells\">cells</a> &middot; <a href=\"" + path +
          "/nearest?at=" + middleOf(served) + "&amp;k=3\">segments nearest to the middle</a>\n";
  const std::string source = "precomputed://" + page.server + "/precomputed" + page.doors + "/" + name;
  html += "<h3>Neuroglancer</h3>\n";
  if (!page.neuroglancer.empty())
    html += "<p><a rel=\"noreferrer\" href=\"" +
            htmlText(page.neuroglancer + "#!" + fragmentText(neuroglancerState(served, source))) +
            "\">Open in Neuroglancer</a>, or add a layer with the source\n";
  else
    html += "<p>Start the server with <code>--neuroglancer URL</code>, then add a layer with the source\n";
  html += code(source);
  html += "<p>A Neuroglancer with spatially indexed skeletons and the data source CATMAID takes\n" +
          code("catmaid://" + page.server + "/catmaid" + page.doors + "/" + name + "/1");
  html += "<h3>Python</h3>\n" +
          code("import filiform as ff" + std::string(page.token ? "  # FILIFORM_TOKEN holds the token" : "") +
               "\ns = ff.open(\"" + set + "\")\nprint(s.nearest([[" + middleOf(served) + "]], k=3))");
  return html + "<h3>Any program</h3>\n" +
         code("curl" + std::string(page.token ? " -H \"Authorization: Bearer $FILIFORM_TOKEN\"" : "") + " '" + set +
              "/nearest?at=" + middleOf(served) + "&k=3'");
}

}  // namespace

Answer tokenAnswer(const Call& call, const std::string& page) {
  std::string place = page;
  for (const auto& [name, value] : call.request.parameters)
    if (name != "token") place += (place.find('?') == std::string::npos ? '?' : '&') + name + '=' + urlPart(value);
  Answer answer{.status = 303, .headers = {{"Location", place}}};
  const Person& person = *call.request.person;
  if (!person.key.empty()) answer.headers.emplace_back("Set-Cookie", call.service.access.cookie(call.request, person));
  return answer;
}

Answer pageAnswer(const Call& call) {
  if (call.request.parameter("token")) return tokenAnswer(call, "/");
  const Person& person = *call.request.person;
  PageContext page;
  // A proxy with TLS names the client's scheme.
  const std::string scheme = call.request.header("x-forwarded-proto") == "https" ? "https://" : "http://";
  page.server = scheme + std::string(call.request.header("host"));
  page.token = !person.key.empty();
  if (page.token) page.doors = "/~" + call.service.access.capability(person);
  page.pictures = call.service.pictures != nullptr;
  page.neuroglancer = call.service.neuroglancer;
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>filiform</title>"
      "<meta name=\"viewport\" content=\"width=device-width\">"
      "<link rel=\"icon\" href=\"/icon.svg\"><link rel=\"stylesheet\" href=\"/page.css\">"
      "<script src=\"/page.js\"></script></head><body>\n"
      "<h1>filiform</h1>\n<p>Neuron reconstructions, cut into tiles. Positions are in &micro;m.\n";
  for (const auto& served : call.sets()) html += sectionOf(*served, page);
  if (page.token && person.may(Scope::revoke))
    html +=
        "<h2>Addresses for Neuroglancer</h2>\n<p>Whoever has one of the addresses with <code>~</code> can read the "
        "skeletons, without the token. This revokes yours and makes new ones:\n" +
        code("curl -X DELETE -H \"Authorization: Bearer $FILIFORM_TOKEN\" " + page.server + "/v1/capability");
  html +=
      "<hr><p><a href=\"/v1/openapi.json\">Description of the interface</a> &middot; "
      "<a href=\"/metrics\">Metrics</a>\n<p>filiform " +
      htmlText(call.service.version) +
      ", GPL-3.0-or-later, without warranty. It uses Boost (BSL-1.0), Cairo (MPL-1.1), CGAL (GPL-3.0-or-later), CLI11 "
      "(BSD-3-Clause), Eigen (MPL-2.0), FLANN (BSD-3-Clause), Highway (Apache-2.0), JSON for Modern C++ (MIT), libcurl "
      "(curl), libpng (libpng-2.0), libzip (BSD-3-Clause), LZ4 (BSD-2-Clause), toml++ (MIT), xxHash (BSD-2-Clause) and "
      "zlib "
      "(Zlib).\n";
  if (!call.service.source_url.empty())
    html += "<p>Source: <a rel=\"noreferrer\" href=\"" + htmlText(call.service.source_url) + "\">" +
            htmlText(call.service.source_url) + "</a>\n";
  html += "</body></html>\n";
  Answer answer{.type = "text/html; charset=utf-8", .body = std::move(html)};
  call.service.access.addPagePolicy(kPolicy, answer);
  return answer;
}

Answer styleAnswer(const Call&) {
  Answer answer{.type = "text/css; charset=utf-8",
                .body =
                    "body{font:16px/1.5 system-ui,sans-serif;max-width:60em;margin:2em auto;padding:0 1em}"
                    "table{border-collapse:collapse}td,th{padding:.1em .8em .1em 0;text-align:left}"
                    "th{font-weight:normal;color:#555}tr{border-bottom:1px solid #ddd}h3{margin:.8em 0 .2em}"
                    "img{max-width:100%;height:auto;background:#fff;border:1px solid #ddd}"
                    "pre{background:#f4f4f4;padding:.6em .8em;margin:.2em 0;overflow:auto}\n"};
  answer.headers.emplace_back("Cache-Control", "public, max-age=3600");
  return answer;
}

// A busy server answers a picture with 503 and draws on; a browser does not ask again by itself.
Answer scriptAnswer(const Call&) {
  Answer answer{.type = "text/javascript; charset=utf-8",
                .body =
                    "const tries = new Map();\n"
                    "document.addEventListener('error', ({target}) => {\n"
                    "  if (target.tagName !== 'IMG') return;\n"
                    "  const failed = (tries.get(target) || 0) + 1;\n"
                    "  tries.set(target, failed);\n"
                    "  if (failed <= 20) setTimeout(() => { target.src = target.src; }, 1000);\n"
                    "}, true);\n"};
  answer.headers.emplace_back("Cache-Control", "public, max-age=3600");
  return answer;
}

Answer iconAnswer(const Call&) {
  Answer answer{.type = "image/svg+xml",
                .body =
                    "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 16 16\"><path d=\"M8 15V9M8 9 3 2M8 9l5-6"
                    "\" fill=\"none\" stroke=\"#06c\" stroke-width=\"2\" stroke-linecap=\"round\"/></svg>\n"};
  answer.headers.emplace_back("Cache-Control", "public, max-age=3600");
  return answer;
}

Answer capabilityAnswer(const Call& call) {
  Access& access = call.service.access;
  if (call.request.method == "DELETE") access.revokeCapability(*call.request.person);
  const std::string part = access.capability(*call.request.person);
  nlohmann::ordered_json json{{"capability", nullptr}, {"precomputed", "/precomputed/"}, {"catmaid", "/catmaid/"}};
  if (!part.empty())
    json = {
        {"capability", part}, {"precomputed", "/precomputed/~" + part + "/"}, {"catmaid", "/catmaid/~" + part + "/"}};
  return jsonAnswer(json);
}

}  // namespace filiform::tools
