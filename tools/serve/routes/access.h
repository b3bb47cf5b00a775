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

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

struct AccessRules {
  std::string token;                 // empty: everyone may ask
  std::vector<std::string> origins;  // such as https://lab.example
  std::vector<std::string> hosts;    // names under which clients reach the server
  std::string link_key = {};         // the capability is made of it and of the token; empty: the capability is random
};

class Access {
 public:
  // Throws UsageError for an origin that is not SCHEME://HOST[:PORT].
  explicit Access(AccessRules rules);

  // Why the request is refused (400, 401, 403, 421, 429), or nullopt. `open`: the route needs no token. A request with
  // a capability needs this instead of the token.
  std::optional<Answer> refuse(const Request& request, bool open) const;
  // True if the text is the token. Takes the same time for each text of the same length.
  bool isToken(std::string_view text) const;
  bool needsToken() const { return needs_token_; }
  // Takes another token from now on, which must not be empty. Cookies and the capability of the old one are refused.
  void setToken(const std::string& token);
  // The header Set-Cookie for a browser that gave the token: a random text that is signed with the token, so that each
  // server with this token accepts it. Its name holds the port, because browsers send cookies to all ports of a host.
  std::string cookie(const Request& request) const;
  // The answer to a wrong token: 401, or 429 after kMostWrong from this client in a minute.
  Answer wrongToken(const Request& request) const;
  // The current capability; empty if no token is needed.
  std::string capability() const;
  // Replaces the capability. Addresses with the old one are refused from now on. Does nothing if no token is needed.
  // Throws Refusal (409) if it is made of a key.
  void revokeCapability();
  // Makes the capability of another key from now on.
  void setLinkKey(const std::string& key);
  // Adds what a browser needs to hand the answer to a page of a listed origin.
  void addCors(const Request& request, Answer& answer) const;

 private:
  struct Wrong {
    std::chrono::steady_clock::time_point since;
    unsigned count = 0;
  };
  bool isListed(std::string_view origin) const;
  unsigned countWrong(const std::string& client) const;  // those of the client's present minute
  bool hasCookie(const Request& request) const;
  std::string token() const;
  std::string freshCapability() const;
  AccessRules rules_;
  const bool needs_token_;
  mutable std::mutex mutex_;  // of the token and of what follows
  std::string capability_;
  mutable std::map<std::string, Wrong> wrong_;
};

// 128 random bits as hexadecimal digits. Throws IoError.
std::string randomText();

// Wrong tokens of a client in a minute, from which on it gets 429 for each.
inline constexpr unsigned kMostWrong = 20;

// Reads the token of an option's file as readTokenFile() does (token.h), and checks that it has 16 to 512 characters
// without `;` `,` `"` `\`. Throws IoError, UsageError.
std::string readToken(const std::string& option, const std::string& path);

}  // namespace filiform::tools
