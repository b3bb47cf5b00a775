// The page in which a browser travels through a set, and its files. viewer/web makes the files.
#include "tools/serve/routes/html.h"
#include "tools/serve/routes/service.h"

#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>
#include <string_view>

namespace filiform::tools {

namespace {

constexpr const char* kTravelPolicy =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; connect-src 'self'; style-src "
    "'self'; "
    "img-src 'self' blob:; base-uri 'none'; form-action 'none'";

// Browsers give threads only to pages that are isolated from others in this way.
void isolate(Answer& answer) {
  answer.headers.emplace_back("Cross-Origin-Opener-Policy", "same-origin");
  answer.headers.emplace_back("Cross-Origin-Embedder-Policy", "require-corp");
}

std::optional<std::string> fileContent(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(in), {});
}

// Changes with every file of the page.
std::string versionOf(const std::string& folder) {
  std::string all;
  for (const char* const name :
       {"travel.css", "travel.js", "reader.js", "filiform.js", "filiform.worker.js", "filiform.wasm"})
    all += fileContent(folder + "/" + name + ".gz").value_or("");
  char version[24];
  std::snprintf(version, sizeof version, "%016llx", static_cast<unsigned long long>(std::hash<std::string>()(all)));
  return version;
}

const char* mediaTypeOf(std::string_view name) {
  if (name.ends_with(".wasm")) return "application/wasm";
  return name.ends_with(".css") ? "text/css; charset=utf-8" : "text/javascript; charset=utf-8";
}

}  // namespace

Answer travelAnswer(const Call& call) {
  if (call.request.parameter("token")) return tokenAnswer(call, "/travel/" + urlPart(call.served->name()));
  const std::string name = htmlText(call.served->name());
  std::string html = "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" + name +
                     " - filiform</title><meta name=\"viewport\" content=\"width=device-width,user-scalable=no\">"
                     "<link rel=\"icon\" href=\"/icon.svg\">";
  Answer answer{.type = "text/html; charset=utf-8"};
  if (call.service.web_folder.empty()) {
    html +=
        "</head><body><p>This page is not built: run <code>tools/setup --web && "
        "cmake --workflow --preset web</code>, then start the server again.</body></html>\n";
  } else {
    const std::string version = versionOf(call.service.web_folder);
    const auto file = [&](const std::string& before, const char* which, const char* after) {
      html += before + "/travel/page/" + which + "?v=" + version + after;
    };
    file("<link rel=\"stylesheet\" href=\"", "travel.css", "\">");
    // The browser asks for these at once, and not when the script before has run.
    file("<link rel=\"preload\" as=\"fetch\" crossorigin href=\"", "filiform.wasm", "\">");
    file("<link rel=\"preload\" as=\"script\" href=\"", "filiform.js", "\">");
    html += "</head><body data-set=\"/v1/sets/" + urlPart(call.served->name()) + "\" data-version=\"" + version +
            "\"><canvas id=\"canvas\" tabindex=\"0\"></canvas>\n<p id=\"note\">loading</p>\n"
            "<noscript><p>This page needs JavaScript.</noscript>\n";
    file("<script src=\"", "travel.js", "\"></script></body></html>\n");
  }
  answer.body = std::move(html);
  call.service.access.addPagePolicy(kTravelPolicy, answer);
  isolate(answer);
  return answer;
}

// Only the names that the table of routes lists come here.
Answer travelFileAnswer(const Call& call) {
  const std::string& name = call.request.parts.back();
  const std::string path = call.service.web_folder + "/" + name;
  const bool zipped = call.request.takesGzip();
  std::optional<std::string> content;
  if (!call.service.web_folder.empty()) content = fileContent(zipped ? path + ".gz" : path);
  if (!content)
    throw Refusal(404, "the page for travel is not built; run tools/setup --web && cmake --workflow --preset web");
  char tag[24];
  std::snprintf(tag, sizeof tag, "\"%016llx\"", static_cast<unsigned long long>(std::hash<std::string>()(*content)));
  Answer answer{.type = mediaTypeOf(name), .body = std::move(*content)};
  const bool is_lasting = call.request.parameter("v").has_value();
  answer.headers = {{"Cache-Control", is_lasting ? "max-age=31536000, immutable" : "no-cache"},
                    {"ETag", tag},
                    {"Vary", "Accept-Encoding"}};
  isolate(answer);
  if (call.request.header("if-none-match") == tag) {
    answer.status = 304;
    answer.type.clear();
    answer.body.clear();
  } else if (zipped) {
    answer.headers.emplace_back("Content-Encoding", "gzip");
  }
  return answer;
}

}  // namespace filiform::tools
