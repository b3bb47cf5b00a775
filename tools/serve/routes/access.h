// Access: who may ask. It checks the host and origin of a request and its token.
//
// Host: a page of another site that gives its own name this server's address (DNS rebinding) sends that name; names
// other than localhost and those of AccessRules are refused. Addresses always pass. Origin: absent, this server's own,
// or one of the list; all others are refused.
//
// Capability: Neuroglancer cannot send a token. With a token, its addresses therefore hold a random text, which opens
// these addresses only and can be revoked. Thread rule: internally synchronised.
#pragma once

#include "tools/serve/routes/request.h"
#include "tools/words/answer.h"

#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

struct AccessRules {
  std::string token;                 // empty: everyone may ask
  std::vector<std::string> origins;  // such as https://lab.example
  std::vector<std::string> hosts;    // names under which clients reach the server
};

class Access {
 public:
  // Throws UsageError for an origin that is not SCHEME://HOST[:PORT].
  explicit Access(AccessRules rules);

  // Why the request is refused (400, 401, 403, 421), or nullopt. `open`: the route needs no token. A request with a
  // capability needs this instead of the token.
  std::optional<Answer> refuse(const Request& request, bool open) const;
  // True if the text is the token. Takes the same time for each text of the same length.
  bool isToken(std::string_view text) const;
  bool needsToken() const { return !rules_.token.empty(); }
  // The current capability; empty if no token is needed.
  std::string capability() const;
  // Replaces the capability. Addresses with the old one are refused from now on. Does nothing if no token is needed.
  void revokeCapability();
  // Adds what a browser needs to hand the answer to a page of a listed origin.
  void addCors(const Request& request, Answer& answer) const;

 private:
  bool isListed(std::string_view origin) const;
  AccessRules rules_;
  mutable std::mutex mutex_;
  std::string capability_;  // guarded by mutex_
};

// 128 random bits as hexadecimal digits. Throws IoError.
std::string randomText();

// The cookie that holds the token of a browser.
inline constexpr const char* kTokenCookie = "filiform_token";

// Reads the token of a file as readTokenFile() does (token.h), and checks that it has 16 to 512 characters without `;`
// `,` `"` `\`. Throws IoError, UsageError.
std::string readToken(const std::string& path);

}  // namespace filiform::tools
