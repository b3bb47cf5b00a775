#include "tools/serve/people/person.h"

#include "index/cell/glob.h"

#include <algorithm>

namespace filiform::tools {

namespace {

bool matchesAny(std::string_view name, const std::vector<std::string>& patterns) {
  return std::any_of(patterns.begin(), patterns.end(),
                     [name](const std::string& pattern) { return matchesGlob(pattern, name); });
}

}  // namespace

const char* toString(Scope scope) {
  switch (scope) {
    case Scope::read:
      return "read";
    case Scope::metrics:
      return "metrics";
    case Scope::revoke:
      return "revoke";
    case Scope::session:
      return "session";
    case Scope::open:
      break;
  }
  return "open";
}

bool Person::may(Scope scope) const {
  return scope == Scope::open || std::find(scopes.begin(), scopes.end(), scope) != scopes.end();
}

bool Person::sees(std::string_view set, const std::vector<std::string>& readers) const {
  return matchesAny(set, sets) && (readers.empty() || name.empty() || matchesAny(name, readers));
}

bool Person::seesAll() const { return std::find(sets.begin(), sets.end(), "*") != sets.end(); }

}  // namespace filiform::tools
