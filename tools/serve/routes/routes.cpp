#include "tools/serve/routes/routes.h"

#include "index/text.h"
#include "tools/serve/routes/gzip.h"
#include "tools/serve/sets/limits.h"

#include <cstdio>
#include <exception>
#include <new>
#include <utility>

namespace filiform::tools {

namespace {

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
    for (const Route& route : allRoutes()) all.push_back(partsOf(route.path));
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

}  // namespace

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
  if (!service_.access.isOpen() && request.parts.size() > 1 &&
      (request.parts[0] == "precomputed" || request.parts[0] == "catmaid") && request.parts[1].starts_with('~')) {
    request.capability = request.parts[1].substr(1);
    request.parts.erase(request.parts.begin() + 1);
  }
  std::vector<std::string> captured;
  for (std::size_t i = 0; i < allRoutes().size(); ++i) {
    const Route& route = allRoutes()[i];
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

void Routes::count(AccessRefusal::Reason reason) const {
  switch (reason) {
    case AccessRefusal::Reason::many_tokens:
      ++service_.metrics.slowed_tokens;
      [[fallthrough]];
    case AccessRefusal::Reason::no_token:
    case AccessRefusal::Reason::wrong_token:
      ++service_.metrics.refused_tokens;
      break;
    case AccessRefusal::Reason::quota:
      ++service_.metrics.refused_quotas;
      break;
    case AccessRefusal::Reason::other:
      break;
  }
}

std::optional<Routed> Routes::refuse(Request& head) const {
  const char* path = "";
  try {
    if (head.target.size() > limits::kTargetBytes) throw Refusal(400, "the URL is longer than 8 KiB");
    const Found found = find(head);
    if (found.same_path != nullptr) path = found.same_path->path;
    const bool is_page = found.route != nullptr && std::string_view(found.route->type) == "text/html";
    // Before the set is looked for, so that names of sets cannot be tried without a token.
    if (auto refusal = service_.access.refuse(head, found.route != nullptr ? found.route->scope : Scope::read,
                                              is_page ? head.parameter("token") : std::nullopt, is_page)) {
      count(refusal->reason);
      return finished(head, std::move(refusal->answer), path);
    }
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
  head.is_judged = true;
  return std::nullopt;
}

bool Routes::isShort(const Request& request) {
  const auto is = [path = std::string_view(request.target)](std::string_view name) {
    return path.starts_with(name) && (path.size() == name.size() || path[name.size()] == '?');
  };
  return is("/healthz") || is("/readyz") || is("/metrics");
}

Routed Routes::answer(Request& request, const std::atomic<bool>* left) const {
  if (!request.is_judged)
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
      const Person* const who = request.person.get();
      call.served = service_.shelf.find(found.captured.front(), who);
      if (call.served == nullptr && service_.shelf.has(found.captured.front(), who))
        throw Refusal(503, "this set cannot be read now; the server's log says why");
      if (call.served == nullptr)
        throw Refusal(404, "no set has the name '" + escaped(found.captured.front(), 80) + "'; /v1/sets lists them");
    }
    const std::string tag = tagOf(call);
    const bool any_tag = request.header("if-none-match") == "*";
    if (!tag.empty() && !any_tag && hasTag(request.header("if-none-match"), tag))
      return finished(request, tagged({.status = 304}, tag, !service_.access.isOpen()), path);
    Answer answer = found.route->answer(call);
    if (!tag.empty() && answer.status == 200 && answer.header("Cache-Control").empty())
      answer = tagged(any_tag ? Answer{.status = 304} : std::move(answer), tag, !service_.access.isOpen());
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
