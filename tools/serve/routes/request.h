// Request: what a route needs of an HTTP request.
//
//   Request request{.method = "GET", .target = "/v1/sets/column/nearest?at=1,2,3"};
//   request.parseTarget();
//   request.parts;               // v1, sets, column, nearest
//   request.parameter("at");     // 1,2,3
//
// Thread rule: a value.
#pragma once

#include "tools/serve/people/person.h"

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

struct Request {
  std::string method;                          // as sent
  std::string target;                          // as sent: path and query
  std::map<std::string, std::string> headers;  // names in lower case
  std::string body;
  std::string client;   // its address; the server fills it
  std::string user;     // whom a stated proxy names; empty: nobody; the server fills it
  bool is_tls = false;  // a stated proxy says that the client used https

  PersonPointer person;    // who asks; Access fills it
  bool is_judged = false;  // Routes::refuse() has let it pass

  // What parseTarget() finds, decoded. Parts may hold any bytes.
  std::vector<std::string> parts;
  std::map<std::string, std::string> parameters;
  // Of an address /precomputed/~CAPABILITY/... or /catmaid/~CAPABILITY/...: Routes moves that part here from `parts`.
  std::optional<std::string> capability;

  // Splits the target. `+` stands for itself. Throws Refusal (400) if the target does not begin with `/`, has
  // characters that a URL may not hold, a wrong %XX, or the same parameter twice. O(length).
  void parseTarget();

  // The value of a header or parameter; empty or nullopt if it is absent.
  std::string_view header(const std::string& name) const;
  std::optional<std::string> parameter(const std::string& name) const;
  // True if the client takes gzip: Accept-Encoding names it, and not with q=0.
  bool takesGzip() const;
  // Like parameter(), as a finite number or a whole number. Throw Refusal (400) for anything else.
  std::optional<double> number(const std::string& name) const;
  std::optional<std::uint64_t> whole(const std::string& name, std::uint64_t least, std::uint64_t most) const;
  // True if the parameter is the first of two words; the second stands for its absence. Throws as number().
  bool isFirst(const std::string& name, std::string_view first, std::string_view second) const;
};

// The target with the values of all parameters named `token`, and all parts that begin with ~, replaced; for logs.
// O(length).
std::string redacted(const std::string& target);

// True if the value of If-None-Match names the tag, or is *. O(length).
bool hasTag(std::string_view list, const std::string& tag);

// Reads `count` numbers with commas between. Throws Refusal (400), which names `name`.
std::vector<double> parseNumbers(const std::string& name, const std::string& text, std::size_t count);

}  // namespace filiform::tools
