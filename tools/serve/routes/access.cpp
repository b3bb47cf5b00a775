#include "tools/serve/routes/access.h"

#include "index/errors.h"
#include "index/file/signature.h"
#include "index/text.h"
#include "tools/serve/people/secret.h"
#include "tools/serve/routes/cookie.h"
#include "tools/serve/routes/session_request.h"

#include <algorithm>
#include <arpa/inet.h>
#include <utility>

namespace filiform::tools {

namespace {

constexpr std::size_t kMarkDigits = 16, kTextDigits = 32;  // of a cookie: its mark; its random text, and a capability

// The host of HOST[:PORT] in lower case, without the brackets of IPv6. Empty if the text is malformed.
std::string hostOf(std::string_view authority) {
  if (authority.starts_with('[')) {
    const std::size_t end = authority.find(']');
    return end == std::string_view::npos ? "" : lowerCase(authority.substr(1, end - 1));
  }
  return lowerCase(authority.substr(0, authority.find(':')));
}

bool isIpAddress(const std::string& host) {
  in6_addr address{};
  return inet_pton(AF_INET, host.c_str(), &address) == 1 || inet_pton(AF_INET6, host.c_str(), &address) == 1;
}

std::string_view givenToken(const Request& request) {
  const std::string_view given = request.header("authorization");
  constexpr std::string_view kScheme = "bearer ";
  if (given.size() > kScheme.size() && lowerCase(given.substr(0, kScheme.size())) == kScheme)
    return given.substr(kScheme.size());
  if (!given.empty()) return {};
  return tokenOfProtocols(request.header("sec-websocket-protocol"));
}

// SCHEME://HOST or SCHEME://HOST:PORT in lower case. `frame`: for frame-ancestors, so a port may be *, and the first
// name of a host too.
bool isOrigin(std::string_view text, bool frame) {
  constexpr std::string_view kWord = "abcdefghijklmnopqrstuvwxyz0123456789+.-";
  const std::size_t scheme = text.find_first_not_of(kWord);
  if (text.empty() || text[0] < 'a' || text[0] > 'z' || scheme == std::string_view::npos ||
      !text.substr(scheme).starts_with("://"))
    return false;
  std::string_view host = text.substr(scheme + 3);
  if (frame && host.ends_with(":*")) host.remove_suffix(2);
  if (frame && host.starts_with("*.")) host.remove_prefix(2);
  const auto isOf = [&host](std::string_view characters) {
    return host.find_first_not_of(characters) == std::string_view::npos;
  };
  return !host.empty() &&
         (isOf("abcdefghijklmnopqrstuvwxyz0123456789.:_-") || (!frame && isOf("0123456789abcdef.:[]")));
}

// A request for a picture, a script and the like of a page of another site, to whom browsers send no Origin. `framed`:
// that site may hold the answer in a frame.
bool isLoadedElsewhere(const Request& request, bool framed) {
  const std::string_view site = request.header("sec-fetch-site"), dest = request.header("sec-fetch-dest");
  const bool is_visit =
      request.header("sec-fetch-mode") == "navigate" && (dest == "document" || (framed && dest == "iframe"));
  return !site.empty() && site != "same-origin" && site != "none" && !is_visit;
}

Answer bearerProblem(const std::string& detail) {
  Answer answer = problem(401, detail);
  answer.headers.emplace_back("WWW-Authenticate", "Bearer");
  return answer;
}

}  // namespace

Access::Access(AccessRules rules)
    : rules_(std::move(rules)), people_(std::make_shared<const People>(rules_.people)), own_key_(randomText()) {
  const auto check = [](const char* option, std::vector<std::string>& origins, bool frame) {
    for (std::string& origin : origins) {
      origin = lowerCase(origin);
      if (!isOrigin(origin, frame))
        throw UsageError(option + inShort(origin) + ": give SCHEME://HOST or SCHEME://HOST:PORT, without a path");
    }
  };
  check("--origin ", rules_.origins, false);
  check("--frame-origin ", rules_.frame_origins, true);
  for (std::string& host : rules_.hosts) host = lowerCase(host);
  makeDoors();
}

// A person without a known token has no secret of their own.
std::string Access::signingKey(const Person& person) const {
  if (!person.token.empty()) return rules_.link_key + '\n' + person.token;
  return (rules_.link_key.empty() ? own_key_ : rules_.link_key) + '\n' + person.key;
}

void Access::makeDoors() {
  std::map<std::string, Door> doors;
  capabilities_.clear();
  marks_.clear();
  for (const PersonPointer& person : people_->all()) {
    const std::string key = signingKey(*person);
    const auto known = doors_.find(person->key);
    std::string capability = !rules_.link_key.empty() ? signatureOf("capability", key).substr(0, kTextDigits)
                             : known != doors_.end()  ? known->second.capability
                                                      : randomText();
    capabilities_[sha256Digits(capability)] = person;
    marks_[signatureOf("mark", key).substr(0, kMarkDigits)] = person;
    doors[person->key] = {person, std::move(capability)};
  }
  doors_ = std::move(doors);
}

std::shared_ptr<const People> Access::people() const {
  const std::lock_guard lock(mutex_);
  return people_;
}

bool Access::isOpen() const { return people()->isOpen(); }

void Access::setPeople(People people) {
  const std::lock_guard lock(mutex_);
  people_ = std::make_shared<const People>(std::move(people));
  makeDoors();
}

std::string Access::capability(const Person& person) const {
  const std::lock_guard lock(mutex_);
  const auto found = doors_.find(person.key);
  return found == doors_.end() ? "" : found->second.capability;
}

void Access::revokeCapability(const Person& person) {
  const std::lock_guard lock(mutex_);
  const auto found = doors_.find(person.key);
  if (found == doors_.end()) throw Refusal(400, "you need no token here, so that there is nothing to revoke");
  if (!rules_.link_key.empty())
    throw Refusal(409, "the links are made of --link-key; change that file for all servers, which read it again");
  found->second.capability = randomText();
  makeDoors();
}

void Access::setLinkKey(const std::string& key) {
  const std::lock_guard lock(mutex_);
  rules_.link_key = key;
  makeDoors();
}

PersonPointer Access::byCapability(const std::string& capability) const {
  const std::lock_guard lock(mutex_);
  const auto found = capabilities_.find(sha256Digits(capability));
  return found == capabilities_.end() ? nullptr : found->second;
}

std::string Access::cookie(const Request& request, const Person& person) const {
  const std::lock_guard lock(mutex_);
  const std::string key = signingKey(person), text = signatureOf("mark", key).substr(0, kMarkDigits) + randomText();
  return setCookie(request, text + signatureOf(text, key));
}

PersonPointer Access::byCookie(const Request& request) const {
  constexpr std::size_t kSigned = kMarkDigits + kTextDigits;
  const std::string_view value = cookieOf(request);
  if (value.size() <= kSigned) return nullptr;
  const std::lock_guard lock(mutex_);
  const auto found = marks_.find(std::string(value.substr(0, kMarkDigits)));
  if (found == marks_.end() || found->second->key.starts_with("user ")) return nullptr;
  const std::string right = signatureOf(value.substr(0, kSigned), signingKey(*found->second));
  return isSecret(value.substr(kSigned), right) ? found->second : nullptr;
}

bool Access::isListed(std::string_view origin) const {
  return std::find(rules_.origins.begin(), rules_.origins.end(), lowerCase(origin)) != rules_.origins.end();
}

std::optional<AccessRefusal> Access::refuseSite(const Request& request, Scope scope, bool is_page) const {
  const std::string_view authority = request.header("host");
  if (authority.empty()) return AccessRefusal{problem(400, "the request has no Host header")};
  const std::string host = hostOf(authority);
  if (host != "localhost" && !isIpAddress(host) &&
      std::find(rules_.hosts.begin(), rules_.hosts.end(), host) == rules_.hosts.end())
    return AccessRefusal{
        problem(421, "this server has not the name '" + escaped(host, 80) + "'; start it with --host NAME")};
  const std::string_view origin = request.header("origin");
  const bool own =
      lowerCase(origin) == "http://" + lowerCase(authority) || lowerCase(origin) == "https://" + lowerCase(authority);
  if (!origin.empty() && !own && !isListed(origin))
    return AccessRefusal{
        problem(403, "pages of " + escaped(origin, 80) + " may not ask; start the server with --origin URL")};
  if (scope != Scope::open && origin.empty() && isLoadedElsewhere(request, is_page && !rules_.frame_origins.empty()))
    return AccessRefusal{problem(403, "pages of other sites may not show this; open it in a window of its own")};
  return std::nullopt;
}

// The user that a proxy names comes before a token, which may be one for the proxy.
std::optional<AccessRefusal> Access::findPerson(Request& request, const std::optional<std::string>& page_token) {
  const std::shared_ptr<const People> people = this->people();
  if (!page_token && !request.user.empty()) {
    request.person = people->user(request.user);
    if (request.person != nullptr) return std::nullopt;
    return AccessRefusal{problem(403, "the user '" + escaped(request.user, 64) +
                                          "' may not ask; whoever runs this server can add a [[user]] to --tokens")};
  }
  const std::string_view token = page_token ? std::string_view(*page_token) : givenToken(request);
  if (!token.empty() || page_token) {
    request.person = people->byToken(token);
    if (request.person == nullptr && !people->isOpen()) return wrongToken(request);
  } else if (request.header("authorization").empty()) {
    request.person = byCookie(request);
  }
  if (request.person == nullptr) request.person = people->anonymous();
  if (request.person != nullptr) return std::nullopt;
  return AccessRefusal{bearerProblem("send the header 'Authorization: Bearer TOKEN', with a token of this server; a "
                                     "browser opens the link that the server prints"),
                       Reason::no_token};
}

std::optional<AccessRefusal> Access::refuse(Request& request, Scope scope, const std::optional<std::string>& page_token,
                                            bool is_page) {
  request.person = nullptr;
  if (auto refused = refuseSite(request, scope, is_page)) return refused;
  // A browser sends no token before it asks for leave.
  if (request.method == "OPTIONS") return std::nullopt;
  if (request.capability) {
    request.person = byCapability(*request.capability);
    if (request.person == nullptr)
      return AccessRefusal{problem(401, "this address was revoked; the server's page has the present one"),
                           Reason::no_token};
  } else if (scope == Scope::open) {
    return std::nullopt;
  } else if (auto refused = findPerson(request, page_token)) {
    return refused;
  }
  const Person& person = *request.person;
  if (!person.may(scope))
    return AccessRefusal{problem(403, std::string("you have not the scope '") + toString(scope) +
                                          "'; whoever runs this server can add it to your entry in --tokens")};
  if (const unsigned wait_s = quotas_.take(person.key.empty() ? request.client : person.name + ' ' + person.entry,
                                           person.requests_per_minute);
      wait_s > 0) {
    Answer answer = problem(429, "your " + std::to_string(person.requests_per_minute) +
                                     " requests a minute are used; ask again in " + std::to_string(wait_s) + " s");
    std::erase_if(answer.headers, [](const auto& header) { return header.first == "Retry-After"; });
    answer.headers.emplace_back("Retry-After", std::to_string(wait_s));
    return AccessRefusal{std::move(answer), Reason::quota};
  }
  return std::nullopt;
}

AccessRefusal Access::wrongToken(const Request& request) {
  const unsigned tried = wrong_tokens_.count(request.client);
  if (tried == kMostWrong + 1 && rules_.tell)
    rules_.tell(request.client + " has sent more than 20 wrong tokens in a minute; each further one waits a second");
  if (tried > kMostWrong)
    return {problem(429, "more than 20 wrong tokens in a minute; ask whoever runs this server for the right one"),
            Reason::many_tokens};
  return {bearerProblem("this is not the server's token"), Reason::wrong_token};
}

void Access::addCors(const Request& request, Answer& answer) const {
  if (rules_.origins.empty()) return;
  answer.headers.emplace_back("Vary", "Origin");
  const std::string_view origin = request.header("origin");
  if (!isListed(origin)) return;
  answer.headers.emplace_back("Access-Control-Allow-Origin", std::string(origin));
  answer.headers.emplace_back("Access-Control-Expose-Headers",
                              "Accept-Ranges, Content-Range, ETag, Filiform-Cursor, Filiform-Truncated, Retry-After");
  if (request.method != "OPTIONS") return;
  answer.headers.emplace_back("Access-Control-Allow-Methods", "GET, HEAD, POST");
  answer.headers.emplace_back("Access-Control-Allow-Headers",
                              "Accept, Authorization, Content-Type, If-None-Match, Range");
  answer.headers.emplace_back("Access-Control-Max-Age", "600");
}

void Access::addPagePolicy(const std::string& policy, Answer& answer) const {
  std::string holders;
  for (const std::string& origin : rules_.frame_origins) holders += ' ' + origin;
  answer.headers.emplace_back("Content-Security-Policy",
                              policy + "; frame-ancestors" + (holders.empty() ? " 'none'" : holders));
  // A page that is isolated holds only pages that say so.
  if (!holders.empty()) answer.headers.emplace_back("Cross-Origin-Resource-Policy", "cross-origin");
}

}  // namespace filiform::tools
