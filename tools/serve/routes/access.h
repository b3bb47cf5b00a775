// Access: who may ask. It checks the host and origin of a request, finds the person who asks, and what they may do.
//
// Host: a page of another site that gives its own name this server's address (DNS rebinding) sends that name; names
// other than localhost and those of AccessRules are refused. Addresses always pass. Origin: absent, this server's own,
// or one of the list; all others are refused. Pages of other sites may not load pictures and the like either.
//
// Person: the user that a stated proxy names; or whose token the request has, or the cookie of a log-in with it; or the
// anonymous one. Capability: Neuroglancer cannot send a token. Its addresses therefore hold a random text, one a
// person, which opens these addresses only and can be revoked. Thread rule: internally synchronised.
#pragma once

#include "tools/serve/people/people.h"
#include "tools/serve/people/quotas.h"
#include "tools/serve/routes/request.h"
#include "tools/words/answer.h"

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

struct AccessRules {
  People people = {};
  std::vector<std::string> origins;                        // such as https://lab.example
  std::vector<std::string> frame_origins = {};             // whose pages may hold the server's pages in a frame
  std::vector<std::string> hosts;                          // names under which clients reach the server
  std::string link_key = {};                               // makes capabilities; empty: they are random
  std::function<void(const std::string& line)> tell = {};  // gets a line about each client that tries tokens
};

struct AccessRefusal {
  enum class Reason { other, no_token, wrong_token, many_tokens, quota };
  Answer answer;
  Reason reason = Reason::other;
};

class Access {
 public:
  // Throws UsageError for an origin that is not SCHEME://HOST[:PORT].
  explicit Access(AccessRules rules);

  // Why the request is refused (400, 401, 403, 421, 429), or nullopt: `request.person` is then who asks, except for
  // Scope::open and OPTIONS. A request with a capability needs this instead of a token. `page_token`: the parameter
  // `token` of a page, which counts instead of all else. `is_page`: the answer has addPagePolicy(), so that it may come
  // into a frame of another page. Takes a request from the person's quota.
  std::optional<AccessRefusal> refuse(Request& request, Scope scope,
                                      const std::optional<std::string>& page_token = std::nullopt,
                                      bool is_page = false);
  // True if everybody may ask everything.
  bool isOpen() const;
  // Admits these people from now on, and keeps the capabilities of those that stay. Cookies and capabilities of others
  // are refused.
  void setPeople(People people);
  // The header Set-Cookie for the browser of a person with a token: a random text that is signed with the token, so
  // that each server with this token accepts it.
  std::string cookie(const Request& request, const Person& person) const;
  // The person's capability; empty if they need none.
  std::string capability(const Person& person) const;
  // Replaces the person's capability. Addresses with the old one are refused from now on. Throws Refusal: 400 if the
  // person needs none, 409 if it is made of a key.
  void revokeCapability(const Person& person);
  // Makes the capabilities of another key from now on.
  void setLinkKey(const std::string& key);
  // Adds what a browser needs to hand the answer to a page of a listed origin.
  void addCors(const Request& request, Answer& answer) const;
  // Adds the policy of a page, and which pages may hold it in a frame.
  void addPagePolicy(const std::string& policy, Answer& answer) const;

 private:
  // What opens for a person beside a token.
  struct Door {
    PersonPointer person;
    std::string capability;
  };
  using Reason = AccessRefusal::Reason;

  std::optional<AccessRefusal> refuseSite(const Request& request, Scope scope, bool is_page) const;
  std::optional<AccessRefusal> findPerson(Request& request, const std::optional<std::string>& page_token);
  AccessRefusal wrongToken(const Request& request);
  bool isListed(std::string_view origin) const;
  std::shared_ptr<const People> people() const;
  std::string signingKey(const Person& person) const;
  PersonPointer byCookie(const Request& request) const;
  PersonPointer byCapability(const std::string& capability) const;
  void makeDoors();

  AccessRules rules_;
  std::shared_ptr<const People> people_;
  const std::string own_key_;
  Quotas quotas_, wrong_tokens_;
  mutable std::mutex mutex_;                           // of people, key and doors
  std::map<std::string, Door> doors_;                  // by the person's key
  std::map<std::string, PersonPointer> capabilities_;  // by their digest
  std::map<std::string, PersonPointer> marks_;         // by the first part of their cookies
};

// Wrong tokens of a client in a minute, from which on it gets 429 for each.
inline constexpr unsigned kMostWrong = 20;

}  // namespace filiform::tools
