// Who may ask: hosts, origins, tokens.
#include "tools/serve/routes/access.h"

#include "index/errors.h"
#include "tests/support/servers/served_sets.h"
#include "tests/support/temp_folder.h"

#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

const std::string kToken = "0123456789abcdef0123";

TEST(Access, OtherHostNamesAreRefused) {
  const test::ServedSets sets({.token = {}, .origins = {}, .hosts = {"Tiles.Example"}});
  for (const char* host : {"localhost", "LOCALHOST:7878", "127.0.0.1:1", "[::1]:7878", "tiles.example", "10.0.0.7"})
    EXPECT_EQ(sets.get("/v1/sets", {{"host", host}}).status, 200u) << host;
  for (const char* host :
       {"evil.example", "localhost.evil.example", "127.0.0.1.evil.example", "[::1", "tiles.example.x"})
    EXPECT_EQ(sets.get("/v1/sets", {{"host", host}}).status, 421u) << host;
  EXPECT_EQ(sets.get("/v1/sets", {{"host", ""}}).status, 400u);
}

TEST(Access, OnlyListedOriginsMayAsk) {
  const test::ServedSets sets({.token = {}, .origins = {"https://lab.example:8443"}, .hosts = {}});
  const Answer listed = sets.get("/v1/sets", {{"origin", "https://lab.example:8443"}});
  EXPECT_EQ(listed.status, 200u);
  EXPECT_EQ(listed.header("Access-Control-Allow-Origin"), "https://lab.example:8443");
  EXPECT_EQ(listed.header("Vary"), "Origin");
  const Answer own = sets.get("/v1/sets", {{"origin", "http://localhost"}});
  EXPECT_EQ(own.status, 200u);
  EXPECT_EQ(own.header("Access-Control-Allow-Origin"), "");
  for (const char* origin : {"https://lab.example", "http://lab.example:8443", "https://lab.example:84430", "null"}) {
    const Answer other = sets.get("/v1/sets", {{"origin", origin}});
    EXPECT_EQ(other.status, 403u) << origin;
    EXPECT_EQ(other.header("Access-Control-Allow-Origin"), "") << origin;
  }
  const Answer preflight = sets.ask("OPTIONS", "/v1/sets/fork/nearest", {{"origin", "https://lab.example:8443"}});
  EXPECT_EQ(preflight.status, 204u);
  EXPECT_NE(preflight.header("Access-Control-Allow-Headers").find("Authorization"), std::string::npos);
  EXPECT_EQ(sets.ask("OPTIONS", "/v1/sets", {{"origin", "https://evil.example"}}).status, 403u);
  EXPECT_THROW(Access({.token = {}, .origins = {"lab.example"}, .hosts = {}}), UsageError);
  EXPECT_THROW(Access({.token = {}, .origins = {"https://lab.example/"}, .hosts = {}}), UsageError);
}

TEST(Access, OnlyTheTokenOpens) {
  const test::ServedSets sets({.token = kToken, .origins = {}, .hosts = {}});
  for (const char* target : {"/", "/metrics", "/v1/sets", "/v1/sets/fork", "/v1/openapi.json", "/nothing"}) {
    EXPECT_EQ(sets.get(target).status, 401u) << target;
    EXPECT_EQ(sets.get(target).header("WWW-Authenticate"), "Bearer") << target;
  }
  EXPECT_EQ(sets.get("/healthz").status, 200u);
  EXPECT_EQ(sets.get("/readyz").status, 200u);
  EXPECT_EQ(sets.get("/v1/sets", {{"authorization", "Bearer " + kToken}}).status, 200u);
  EXPECT_EQ(sets.get("/v1/sets", {{"authorization", "bearer " + kToken}}).status, 200u);
  for (const std::string& wrong : {std::string(), kToken + "0", kToken.substr(1), std::string("x"), kToken + kToken}) {
    EXPECT_EQ(sets.get("/v1/sets", {{"authorization", "Bearer " + wrong}}).status, 401u) << wrong;
    EXPECT_EQ(sets.get("/v1/sets", {{"cookie", "filiform=" + wrong}}).status, 401u) << wrong;
  }
  EXPECT_EQ(sets.get("/v1/sets?token=" + kToken).status, 401u) << "only the page takes it in the URL";
  EXPECT_FALSE(Access({}).isToken(""));
}

TEST(Access, ThePageTurnsTheTokenIntoACookie) {
  const test::ServedSets sets({.token = kToken, .origins = {}, .hosts = {}});
  const Answer right = sets.get("/?token=" + kToken);
  EXPECT_EQ(right.status, 303u);
  EXPECT_EQ(right.header("Location"), "/");
  const std::string cookie = right.header("Set-Cookie"), pair = cookie.substr(0, cookie.find(';'));
  EXPECT_TRUE(pair.starts_with("filiform=")) << pair;
  EXPECT_EQ(cookie.substr(pair.size()), "; HttpOnly; SameSite=Strict; Path=/");
  EXPECT_EQ(cookie.find(kToken), std::string::npos) << "the cookie holds the token";
  EXPECT_NE(sets.get("/?token=" + kToken).header("Set-Cookie"), cookie) << "each log-in has its own value";
  EXPECT_EQ(sets.get("/v1/sets", {{"cookie", "a=b; " + pair + "; c=d"}}).status, 200u);
  EXPECT_EQ(sets.get("/v1/sets", {{"cookie", pair + "0"}}).status, 401u);
  std::string changed = pair;
  changed[12] = changed[12] == '0' ? '1' : '0';
  EXPECT_EQ(sets.get("/v1/sets", {{"cookie", changed}}).status, 401u);
  const test::ServedSets another({.token = kToken, .origins = {}, .hosts = {}});
  EXPECT_EQ(another.get("/v1/sets", {{"cookie", pair}}).status, 200u) << "servers with one token know each other's";
  const Answer wrong = sets.get("/?token=wrong");
  EXPECT_EQ(wrong.status, 401u);
  EXPECT_EQ(wrong.header("Set-Cookie"), "");
}

// Browsers send the cookies of a host to all of its ports.
TEST(Access, ACookieHasTheNameOfItsPort) {
  const Access access({.token = kToken, .origins = {}, .hosts = {}});
  Request request;
  const auto named = [&](const char* host) {
    request.headers["host"] = host;
    const std::string cookie = access.cookie(request);
    return cookie.substr(0, cookie.find('='));
  };
  EXPECT_EQ(named("localhost:7878"), "filiform_7878");
  EXPECT_EQ(named("[::1]:7879"), "filiform_7879");
  EXPECT_EQ(named("[::1]"), "filiform");
  request.is_tls = true;
  EXPECT_EQ(named("tiles.example"), "__Host-filiform");
  EXPECT_TRUE(access.cookie(request).ends_with("; Path=/; Secure"));
}

TEST(Access, AnotherTokenEndsCookiesAndCapability) {
  Access access({.token = kToken, .origins = {}, .hosts = {}});
  Request request;
  request.headers["host"] = "localhost";
  const std::string cookie = access.cookie(request), capability = access.capability();
  request.headers["cookie"] = cookie.substr(0, cookie.find(';'));
  EXPECT_FALSE(access.refuse(request, false));
  access.setToken(kToken + "x");
  EXPECT_TRUE(access.isToken(kToken + "x"));
  EXPECT_FALSE(access.isToken(kToken));
  EXPECT_TRUE(access.refuse(request, false));
  EXPECT_NE(access.capability(), capability);
}

TEST(Access, ServersWithOneLinkKeyShareTheirLinks) {
  const AccessRules rules{.token = kToken, .origins = {}, .hosts = {}, .link_key = "a key of the cluster"};
  Access one(rules), another(rules);
  EXPECT_EQ(one.capability(), another.capability());
  EXPECT_EQ(one.capability().size(), Access({.token = kToken, .origins = {}, .hosts = {}}).capability().size());
  EXPECT_THROW(one.revokeCapability(), Refusal);
  one.setLinkKey("another key of the cluster");
  EXPECT_NE(one.capability(), another.capability());
  another.setLinkKey("another key of the cluster");
  EXPECT_EQ(one.capability(), another.capability());
  one.setToken(kToken + "x");
  EXPECT_NE(one.capability(), another.capability()) << "another token ends the links";
}

TEST(Access, ManyWrongTokensAreCountedAndSlowedDown) {
  const test::ServedSets sets({.token = kToken, .origins = {}, .hosts = {}});
  for (unsigned i = 0; i < kMostWrong; ++i) {
    EXPECT_EQ(sets.get("/v1/sets", {{"authorization", "Bearer x"}}).status, 401u);
    EXPECT_EQ(sets.get("/v1/sets").status, 401u) << "who gives none has not tried one";
  }
  EXPECT_EQ(sets.get("/v1/sets", {{"authorization", "Bearer x"}}).status, 429u);
  EXPECT_EQ(sets.get("/?token=x").status, 429u);
  EXPECT_EQ(sets.get("/v1/sets", {{"authorization", "Bearer " + kToken}}).status, 200u)
      << "another client of the same address";
  EXPECT_EQ(sets.metrics.refused_tokens, 2 * kMostWrong + 2);
}

TEST(Access, NamesOfSetsCannotBeTriedWithoutTheToken) {
  const test::ServedSets sets({.token = kToken, .origins = {}, .hosts = {}});
  for (const char* target : {"/travel/fork?token=bad", "/travel/nosuch?token=bad", "/v1/sets/nosuch"})
    EXPECT_EQ(sets.get(target).status, 401u) << target;
  EXPECT_EQ(sets.get("/travel/nosuch?token=" + kToken).status, 404u);
}

TEST(Access, TokensAreReadFromTheFirstLine) {
  const test::TempFolder folder;
  const auto read = [&](const std::string& bytes) {
    test::writeBytes(folder / "token", bytes);
    return readToken("--token-file", folder / "token");
  };
  EXPECT_EQ(read(kToken), kToken);
  EXPECT_EQ(read("\xEF\xBB\xBF" + kToken + " \r\nmore\n"), kToken);
  for (const std::string wrong : {"", "short", "\n0123456789abcdef0123", "0123456789abcdef 0123",
                                  "0123456789abcdef\t0123", "0123456789abcdef;0123"})
    EXPECT_THROW(read(wrong), UsageError) << wrong;
  EXPECT_THROW(readToken("--token-file", folder / "absent"), IoError);
}

}  // namespace
}  // namespace filiform::tools
