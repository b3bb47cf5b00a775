// The table of routes: which requests are answered, which parameters they may have, and what /v1/openapi.json says.
// Constants.
#pragma once

#include "tools/serve/people/person.h"
#include "tools/words/answer.h"

#include <span>
#include <vector>

namespace filiform::tools {

struct Call;

struct RouteParameter {
  const char* name;
  const char* kind;  // string, number, integer
  const char* meaning;
  bool required = false;
};

struct Route {
  const char* method;  // GET (and HEAD), POST or DELETE
  const char* path;    // {NAME} stands for one part; {set} for the name of a set
  const char* summary;
  const char* type;  // media type of the answer
  std::vector<RouteParameter> parameters;
  Scope scope;  // that the person who asks needs
  Answer (*answer)(const Call& call);
};
std::span<const Route> allRoutes();

}  // namespace filiform::tools
