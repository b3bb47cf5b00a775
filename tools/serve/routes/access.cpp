#include "tools/serve/routes/access.h"

#include "index/file/signature.h"
#include "index/text.h"
#include "tools/serve/routes/session_request.h"
#include "tools/words/token.h"

#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <cerrno>
#include <unistd.h>
#include <utility>

namespace filiform::tools {

namespace {

constexpr std::size_t kLeastToken = 16, kMostToken = 512;

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

// The value of a cookie; empty if it is absent.
std::string_view cookieOf(std::string_view header, std::string_view name) {
  while (!header.empty()) {
    const std::string_view pair = header.substr(0, header.find(';'));
    header.remove_prefix(std::min(header.size(), pair.size() + 1));
    const std::size_t begin = pair.find_first_not_of(' ');
    if (begin == std::string_view::npos) continue;
    const std::string_view trimmed = pair.substr(begin);
    if (trimmed.size() > name.size() && trimmed.starts_with(name) && trimmed[name.size()] == '=')
      return trimmed.substr(name.size() + 1);
  }
  return {};
}

// Takes the same time for each text of the same length. False for an empty secret.
bool isSecret(std::string_view text, const std::string& secret) {
  if (secret.empty()) return false;
  unsigned difference = text.size() == secret.size() ? 0 : 1;
  for (std::size_t i = 0; i < text.size(); ++i)
    difference |= static_cast<unsigned char>(text[i]) ^ static_cast<unsigned char>(secret[i % secret.size()]);
  return difference == 0;
}

std::string_view givenToken(const Request& request) {
  const std::string_view given = request.header("authorization");
  constexpr std::string_view kScheme = "bearer ";
  if (given.size() > kScheme.size() && lowerCase(given.substr(0, kScheme.size())) == kScheme)
    return given.substr(kScheme.size());
  if (!given.empty()) return {};
  return tokenOfProtocols(request.header("sec-websocket-protocol"));
}

std::string cookieName(const Request& request) {
  if (request.is_tls) return "__Host-filiform";  // browsers accept this name over TLS only
  const std::string_view host = request.header("host");
  const std::size_t colon = host.rfind(':');
  const bool has_port = colon != std::string_view::npos && host.find(']', colon) == std::string_view::npos;
  return "filiform" + (has_port ? '_' + std::string(host.substr(colon + 1)) : std::string());
}

// SCHEME://HOST or SCHEME://HOST:PORT in lower case.
bool isOrigin(std::string_view text) {
  const std::size_t scheme = text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789+.-");
  return !text.empty() && text[0] >= 'a' && text[0] <= 'z' && scheme != std::string_view::npos &&
         text.substr(scheme).starts_with("://") && text.size() > scheme + 3 &&
         text.find_first_of("/?#@ ", scheme + 3) == std::string_view::npos;
}

}  // namespace

std::string randomText() {
  std::array<unsigned char, 16> bytes{};
  if (::getentropy(bytes.data(), bytes.size()) != 0) throw IoError("the system's random numbers", "cannot read", errno);
  std::string text;
  for (const unsigned char byte : bytes) {
    static constexpr char kHex[] = "0123456789abcdef";
    (text += kHex[byte >> 4]) += kHex[byte & 15];
  }
  return text;
}

Access::Access(AccessRules rules) : rules_(std::move(rules)), needs_token_(!rules_.token.empty()) {
  for (std::string& origin : rules_.origins) {
    origin = lowerCase(origin);
    if (!isOrigin(origin))
      throw UsageError("--origin " + inShort(origin) + ": give SCHEME://HOST or SCHEME://HOST:PORT, without a path");
  }
  for (std::string& host : rules_.hosts) host = lowerCase(host);
  if (needsToken()) capability_ = freshCapability();
}

std::string Access::capability() const {
  const std::lock_guard lock(mutex_);
  return capability_;
}

std::string Access::freshCapability() const {
  constexpr std::size_t kDigits = 32;
  return rules_.link_key.empty() ? randomText()
                                 : signatureOf("capability " + rules_.token, rules_.link_key).substr(0, kDigits);
}

void Access::revokeCapability() {
  if (!needsToken()) return;
  const std::lock_guard lock(mutex_);
  if (!rules_.link_key.empty())
    throw Refusal(409, "the links are made of --link-key; change that file for all servers, which read it again");
  capability_ = freshCapability();
}

void Access::setLinkKey(const std::string& key) {
  const std::lock_guard lock(mutex_);
  rules_.link_key = key;
  if (needsToken()) capability_ = freshCapability();
}

bool Access::isListed(std::string_view origin) const {
  return std::find(rules_.origins.begin(), rules_.origins.end(), lowerCase(origin)) != rules_.origins.end();
}

std::string Access::token() const {
  const std::lock_guard lock(mutex_);
  return rules_.token;
}

void Access::setToken(const std::string& token) {
  const std::lock_guard lock(mutex_);
  rules_.token = token;
  capability_ = freshCapability();
}

bool Access::isToken(std::string_view text) const { return isSecret(text, token()); }

std::string Access::cookie(const Request& request) const {
  const std::string nonce = randomText();
  return cookieName(request) + '=' + nonce + signatureOf(nonce, token()) + "; HttpOnly; SameSite=Strict; Path=/" +
         (request.is_tls ? "; Secure" : "");
}

bool Access::hasCookie(const Request& request) const {
  constexpr std::size_t kNonce = 32;
  const std::string_view value = cookieOf(request.header("cookie"), cookieName(request));
  return value.size() > kNonce &&
         isSecret(value.substr(kNonce), signatureOf(std::string(value.substr(0, kNonce)), token()));
}

unsigned Access::countWrong(const std::string& client) const {
  constexpr std::size_t kMostClients = 4096;
  const auto now = std::chrono::steady_clock::now();
  const std::lock_guard lock(mutex_);
  if (wrong_.size() > kMostClients) wrong_.clear();
  Wrong& own = wrong_[client];
  if (own.count == 0 || now - own.since > std::chrono::minutes(1)) own = {now, 0};
  return ++own.count;
}

std::optional<Answer> Access::refuse(const Request& request, bool open) const {
  const std::string_view authority = request.header("host");
  if (authority.empty()) return problem(400, "the request has no Host header");
  const std::string host = hostOf(authority);
  if (host != "localhost" && !isIpAddress(host) &&
      std::find(rules_.hosts.begin(), rules_.hosts.end(), host) == rules_.hosts.end())
    return problem(421, "this server has not the name '" + escaped(host, 80) + "'; start it with --host NAME");
  const std::string_view origin = request.header("origin");
  const bool own =
      lowerCase(origin) == "http://" + lowerCase(authority) || lowerCase(origin) == "https://" + lowerCase(authority);
  if (!origin.empty() && !own && !isListed(origin))
    return problem(403, "pages of " + escaped(origin, 80) + " may not ask; start the server with --origin URL");
  if (request.capability && request.method != "OPTIONS") {
    if (isSecret(*request.capability, capability())) return std::nullopt;
    return problem(401, "this address was revoked; the server's page has the present one");
  }
  // A browser sends no token before it asks for leave.
  if (open || !needsToken() || request.method == "OPTIONS") return std::nullopt;
  const std::string_view token = givenToken(request);
  if (isToken(token) || (request.header("authorization").empty() && hasCookie(request))) return std::nullopt;
  if (!token.empty()) return wrongToken(request);
  Answer answer =
      problem(401, "send the header 'Authorization: Bearer TOKEN', with the token of the server's --token-file");
  answer.headers.emplace_back("WWW-Authenticate", "Bearer");
  return answer;
}

Answer Access::wrongToken(const Request& request) const {
  if (countWrong(request.client) > kMostWrong)
    return problem(429, "more than 20 wrong tokens in a minute; ask whoever runs this server for the right one");
  Answer answer = problem(401, "this is not the server's token");
  answer.headers.emplace_back("WWW-Authenticate", "Bearer");
  return answer;
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

std::string readToken(const std::string& option, const std::string& path) {
  std::string token = readTokenFile(option, path);
  if (token.find_first_of(";,\"\\") != std::string::npos || token.size() < kLeastToken || token.size() > kMostToken)
    throw UsageError(option + " " + inShort(path) +
                     ": its first line must be a token of 16 to 512 letters and "
                     "digits, such as 'openssl rand -hex 32' prints");
  return token;
}

}  // namespace filiform::tools
