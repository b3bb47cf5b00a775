// The page of the service and its style.
#include "tools/answers/service.h"
#include "tools/program/numbers.h"

namespace filiform::tools {

namespace {

constexpr const char* kPolicy =
    "default-src 'none'; style-src 'self'; img-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string htmlText(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      case '\'':
        safe += "&#39;";
        break;
      default:
        safe += static_cast<unsigned char>(c) < 0x20 && c != '\n' ? ' ' : c;
    }
  }
  return safe;
}

// A name as a part of a URL's path.
std::string urlPart(const std::string& name) {
  static constexpr char kHex[] = "0123456789ABCDEF";
  std::string part;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte < 0x80 && std::isalnum(byte) != 0) || c == '-' || c == '_' || c == '.' || c == '~')
      part += c;
    else
      ((part += '%') += kHex[byte >> 4]) += kHex[byte & 15];
  }
  return part;
}

std::string rowOfSet(const ServedSet& served) {
  const SetCounts& n = served.set().counts();
  std::string row = "<tr><td><a href=\"/v1/sets/" + urlPart(served.name()) + "\">" + htmlText(served.name()) + "</a>";
  for (const std::string& figure : {formatCount(n.cells), formatCount(n.segments), formatCount(n.tiles),
                                    formatBytes(served.set().bytes()), served.set().revision()})
    row += "<td>" + htmlText(figure);
  return row + "\n";
}

std::string exampleOf(const ServedSet& served, const std::string& server, bool token) {
  const std::string set = server + "/v1/sets/" + urlPart(served.name());
  const std::string header = token ? " -H \"Authorization: Bearer $FILIFORM_TOKEN\"" : "";
  const GridBox& box = served.set().bounds();
  std::string at = "0,0,0";
  if (!box.empty()) {
    const Vector3d lo = served.set().grid().toWorld(box.lo), hi = served.set().grid().toWorld(box.hi);
    at.clear();
    for (int axis = 0; axis < 3; ++axis)
      at += (axis == 0 ? "" : ",") + formatNumber(std::round((lo[axis] + hi[axis]) / 2));
  }
  return "<pre>" +
         htmlText("curl" + header + " '" + set + "/nearest?at=" + at + "&k=3'\ncurl" + header + " '" + set +
                  "/cells'\nfiliform info " + set) +
         "</pre>\n";
}

// The redirect that keeps the token in a cookie and out of the address.
Answer tokenAnswer(const Call& call, const std::string& token) {
  if (!call.service.access.isToken(token)) {
    Answer answer = problem(401, "this is not the server's token");
    answer.headers.emplace_back("WWW-Authenticate", "Bearer");
    return answer;
  }
  Answer answer{.status = 303};
  answer.headers = {{"Location", "/"},
                    {"Set-Cookie", std::string(kTokenCookie) + "=" + token + "; HttpOnly; SameSite=Strict; Path=/"}};
  return answer;
}

}  // namespace

Answer pageAnswer(const Call& call) {
  if (const auto token = call.request.parameter("token")) return tokenAnswer(call, *token);
  const std::string host(call.request.header("host"));
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>filiform</title>"
      "<link rel=\"stylesheet\" href=\"/page.css\">\n<h1>filiform</h1>\n"
      "<p>Neuron reconstructions, cut into tiles. Positions are in &micro;m.\n"
      "<table><tr><th>set<th>cells<th>segments<th>tiles<th>on disk<th>revision\n";
  for (const auto& served : call.service.shelf.all()) html += rowOfSet(*served);
  html += "</table>\n<h2>Open a set</h2>\n";
  for (const auto& served : call.service.shelf.all())
    html += "<h3>" + htmlText(served->name()) + "</h3>\n" +
            exampleOf(*served, "http://" + host, call.service.access.needsToken());
  html +=
      "<p><a href=\"/v1/openapi.json\">Description of the interface</a> &middot; <a href=\"/metrics\">Metrics</a>\n"
      "<p>filiform " +
      htmlText(call.service.version) + ", GPL-3.0-or-later\n</html>\n";
  Answer answer{.type = "text/html; charset=utf-8", .body = std::move(html)};
  answer.headers.emplace_back("Content-Security-Policy", kPolicy);
  return answer;
}

Answer styleAnswer(const Call&) {
  Answer answer{.type = "text/css; charset=utf-8",
                .body =
                    "body{font:16px/1.5 system-ui,sans-serif;max-width:60em;margin:2em auto;padding:0 1em}"
                    "table{border-collapse:collapse}td,th{padding:.2em .8em;text-align:right}"
                    "td:first-child,th:first-child{text-align:left}tr{border-bottom:1px solid #ccc}"
                    "pre{background:#f4f4f4;padding:.8em;overflow:auto}\n"};
  answer.headers.emplace_back("Cache-Control", "public, max-age=3600");
  return answer;
}

}  // namespace filiform::tools
