// Person: who asks, what they may do and which sets they see. Thread rule: a value.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

// What a route needs.
enum class Scope : std::uint8_t {
  open,     // nothing: everybody may ask
  read,     // pages, sets, questions and files
  metrics,  // /metrics
  revoke,   // DELETE /v1/capability
  session,  // sessions and desks
};

// The word in the file of --tokens.
const char* toString(Scope scope);

struct Person {
  std::string name = {};   // for the log and for `readers` of the catalogue; empty: of a server that knows no names
  std::string entry = {};  // the name in the file of --tokens, which may be a pattern; for counters
  std::string key = {};    // tells people apart, also after the file was read again; empty: everybody
  std::string token = {};  // empty: the person has none, or only its digest is known
  std::vector<Scope> scopes = {Scope::read, Scope::metrics, Scope::revoke, Scope::session};
  std::vector<std::string> sets = {"*"};  // names or patterns
  unsigned requests_per_minute = 0;       // 0: no limit

  bool may(Scope scope) const;
  // True if the person may know of this set. `readers`: names or patterns of those who may see it; empty: everybody. A
  // person without a name counts as a reader. O(patterns).
  bool sees(std::string_view set, const std::vector<std::string>& readers) const;
  bool seesAll() const;  // of the sets without readers
};

using PersonPointer = std::shared_ptr<const Person>;

}  // namespace filiform::tools
