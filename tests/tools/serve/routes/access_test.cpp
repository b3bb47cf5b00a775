// Who may ask: hosts, origins, tokens.
#include "tools/serve/routes/access.h"

#include "index/errors.h"
#include "index/file/signature.h"
#include "tests/support/servers/served_sets.h"
#include "tests/support/temp_folder.h"

#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

const std::string kToken = "0123456789abcdef0123";

const Person& theOnly(const std::string& token) {
  static std::map<std::string, People> made;
  return *made.emplace(token, People::ofToken(token)).first->second.all().front();
}

std::string capabilityOf(const Access& access, const std::string& token) { return access.capability(theOnly(token)); }

TEST(Access, OtherHostNamesAreRefused) {
  const test::ServedSets sets({.people = {}, .origins = {}, .hosts = {"Tiles.Example"}});
  for (const char* host : {"localhost", "LOCALHOST:7878", "127.0.0.1:1", "[::1]:7878", "tiles.example", "10.0.0.7"})
    EXPECT_EQ(sets.get("/v1/sets", {{"host", host}}).status, 200u) << host;
  for (const char* host :
       {"evil.example", "localhost.evil.example", "127.0.0.1.evil.example", "[::1", "tiles.example.x"})
    EXPECT_EQ(sets.get("/v1/sets", {{"host", host}}).status, 421u) << host;
  EXPECT_EQ(sets.get("/v1/sets", {{"host", ""}}).status, 400u);
}

TEST(Access, OnlyListedOriginsMayAsk) {
  const test::ServedSets sets({.people = {}, .origins = {"https://lab.example:8443"}, .hosts = {}});
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
  EXPECT_THROW(Access({.people = {}, .origins = {"lab.example"}, .hosts = {}}), UsageError);
  EXPECT_THROW(Access({.people = {}, .origins = {"https://lab.example/"}, .hosts = {}}), UsageError);
}

TEST(Access, OnlyTheTokenOpens) {
  const test::ServedSets sets({.people = People::ofToken(kToken), .origins = {}, .hosts = {}});
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
}

TEST(Access, ThePageTurnsTheTokenIntoACookie) {
  const test::ServedSets sets({.people = People::ofToken(kToken), .origins = {}, .hosts = {}});
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
  const test::ServedSets another({.people = People::ofToken(kToken), .origins = {}, .hosts = {}});
  EXPECT_EQ(another.get("/v1/sets", {{"cookie", pair}}).status, 200u) << "servers with one token know each other's";
  const Answer wrong = sets.get("/?token=wrong");
  EXPECT_EQ(wrong.status, 401u);
  EXPECT_EQ(wrong.header("Set-Cookie"), "");
}

// Browsers send the cookies of a host to all of its ports.
TEST(Access, ACookieHasTheNameOfItsPort) {
  const Access access({.people = People::ofToken(kToken), .origins = {}, .hosts = {}});
  const Person& person = theOnly(kToken);
  Request request;
  const auto named = [&](const char* host) {
    request.headers["host"] = host;
    const std::string cookie = access.cookie(request, person);
    return cookie.substr(0, cookie.find('='));
  };
  EXPECT_EQ(named("localhost:7878"), "filiform_7878");
  EXPECT_EQ(named("[::1]:7879"), "filiform_7879");
  EXPECT_EQ(named("[::1]"), "filiform");
  request.is_tls = true;
  EXPECT_EQ(named("tiles.example"), "__Host-filiform");
  EXPECT_TRUE(access.cookie(request, person).ends_with("; Path=/; Secure"));
}

TEST(Access, AnotherTokenEndsCookiesAndCapability) {
  Access access({.people = People::ofToken(kToken), .origins = {}, .hosts = {}});
  Request request;
  request.headers["host"] = "localhost";
  const std::string cookie = access.cookie(request, theOnly(kToken)), capability = capabilityOf(access, kToken);
  request.headers["cookie"] = cookie.substr(0, cookie.find(';'));
  EXPECT_FALSE(access.refuse(request, Scope::read));
  access.setPeople(People::ofToken(kToken + "x"));
  EXPECT_TRUE(access.refuse(request, Scope::read));
  EXPECT_EQ(capabilityOf(access, kToken), "");
  EXPECT_NE(capabilityOf(access, kToken + "x"), capability);
  request.headers = {{"host", "localhost"}, {"authorization", "Bearer " + kToken}};
  EXPECT_TRUE(access.refuse(request, Scope::read));
  request.headers["authorization"] += "x";
  EXPECT_FALSE(access.refuse(request, Scope::read));
}

TEST(Access, APersonKeepsTheirLinksWhenOthersChange) {
  People people = People::listed();
  people.add({.name = "ann"}, sha256Digits(kToken));
  Access access({.people = people, .origins = {}, .hosts = {}});
  const Person& ann = *people.all().front();
  const std::string capability = access.capability(ann);
  EXPECT_EQ(capability.size(), 32u);
  people.add({.name = "ben"}, sha256Digits(kToken + "x"));
  access.setPeople(people);
  EXPECT_EQ(access.capability(ann), capability);
  EXPECT_NE(access.capability(*people.all().back()), capability);
  access.revokeCapability(*people.all().back());
  EXPECT_EQ(access.capability(ann), capability) << "each revokes their own";
  EXPECT_THROW(access.revokeCapability({}), Refusal);
}

TEST(Access, ServersWithOneLinkKeyShareTheirLinks) {
  const AccessRules rules{
      .people = People::ofToken(kToken), .origins = {}, .hosts = {}, .link_key = "a key of the cluster"};
  Access one(rules), another(rules);
  const auto of = [](const Access& access) { return capabilityOf(access, kToken); };
  EXPECT_EQ(of(one), of(another));
  EXPECT_EQ(of(one).size(), 32u);
  EXPECT_THROW(one.revokeCapability(theOnly(kToken)), Refusal);
  one.setLinkKey("another key of the cluster");
  EXPECT_NE(of(one), of(another));
  another.setLinkKey("another key of the cluster");
  EXPECT_EQ(of(one), of(another));
  one.setPeople(People::ofToken(kToken + "x"));
  EXPECT_NE(capabilityOf(one, kToken + "x"), of(another)) << "another token ends the links";
}

// Without its token a server cannot sign with it: the key of the cluster does, or a key of this run.
TEST(Access, DigestsOfTokensSuffice) {
  People people = People::listed();
  people.add({.name = "ann"}, sha256Digits(kToken));
  Access one({.people = people, .origins = {}, .hosts = {}, .link_key = "a key of the cluster"});
  Access another({.people = people, .origins = {}, .hosts = {}, .link_key = "a key of the cluster"});
  Access alone({.people = people, .origins = {}, .hosts = {}});
  Request request;
  request.headers = {{"host", "localhost"}, {"authorization", "Bearer " + kToken}};
  EXPECT_FALSE(one.refuse(request, Scope::read));
  const std::string cookie = one.cookie(request, *request.person);
  request.headers = {{"host", "localhost"}, {"cookie", cookie.substr(0, cookie.find(';'))}};
  EXPECT_FALSE(another.refuse(request, Scope::read));
  EXPECT_EQ(request.person->name, "ann");
  EXPECT_TRUE(alone.refuse(request, Scope::read)) << "the file of tokens does not suffice to make a cookie";
}

TEST(Access, ManyWrongTokensAreCountedAndSlowedDown) {
  std::vector<std::string> told;
  test::ServedSets sets(
      {.people = People::ofToken(kToken), .origins = {}, .hosts = {}, .tell = [&told](const std::string& line) {
         told.push_back(line);
       }});
  sets.client = "192.0.2.7";
  for (unsigned i = 0; i < kMostWrong; ++i) {
    EXPECT_EQ(sets.get("/v1/sets", {{"authorization", "Bearer x"}}).status, 401u);
    EXPECT_EQ(sets.get("/v1/sets").status, 401u) << "who gives none has not tried one";
  }
  EXPECT_EQ(sets.get("/v1/sets", {{"authorization", "Bearer x"}}).status, 429u);
  EXPECT_EQ(sets.get("/?token=x").status, 429u);
  EXPECT_EQ(sets.get("/v1/sets", {{"authorization", "Bearer " + kToken}}).status, 200u)
      << "another client of the same address";
  EXPECT_EQ(sets.metrics.refused_tokens, 2 * kMostWrong + 2);
  EXPECT_EQ(sets.metrics.slowed_tokens, 2u);
  ASSERT_EQ(told.size(), 1u) << "one line, not one for each";
  EXPECT_NE(told.front().find("192.0.2.7"), std::string::npos) << told.front();
}

TEST(Access, NamesOfSetsCannotBeTriedWithoutTheToken) {
  const test::ServedSets sets({.people = People::ofToken(kToken), .origins = {}, .hosts = {}});
  for (const char* target : {"/travel/fork?token=bad", "/travel/nosuch?token=bad", "/v1/sets/nosuch"})
    EXPECT_EQ(sets.get(target).status, 401u) << target;
  EXPECT_EQ(sets.get("/travel/nosuch?token=" + kToken).status, 404u);
}

// Browsers send no Origin for a picture that a page of another site shows.
TEST(Access, PagesOfOtherSitesLoadNothing) {
  const test::ServedSets sets({.people = {}, .origins = {"https://lab.example"}, .hosts = {}});
  const auto status = [&](const char* site, const char* mode, const char* dest, const char* origin = "") {
    std::map<std::string, std::string> headers{
        {"sec-fetch-site", site}, {"sec-fetch-mode", mode}, {"sec-fetch-dest", dest}};
    if (*origin != '\0') headers["origin"] = origin;
    return sets.get("/v1/sets", headers).status;
  };
  EXPECT_EQ(status("cross-site", "no-cors", "image"), 403u);
  EXPECT_EQ(status("same-site", "no-cors", "script"), 403u) << "another port of this host";
  EXPECT_EQ(status("cross-site", "navigate", "iframe"), 403u);
  EXPECT_EQ(status("cross-site", "navigate", "document"), 200u) << "a link";
  EXPECT_EQ(status("same-origin", "no-cors", "image"), 200u);
  EXPECT_EQ(status("none", "navigate", "document"), 200u);
  EXPECT_EQ(status("cross-site", "cors", "empty", "https://lab.example"), 200u);
  EXPECT_EQ(sets.get("/page.css", {{"sec-fetch-site", "cross-site"}}).status, 200u);
}

TEST(Access, OnlyPagesComeIntoFramesOfListedOrigins) {
  const std::map<std::string, std::string> frame{
      {"sec-fetch-site", "cross-site"}, {"sec-fetch-mode", "navigate"}, {"sec-fetch-dest", "iframe"}};
  const test::ServedSets alone;
  const test::ServedSets held(
      {.people = {}, .origins = {}, .frame_origins = {"http://LocalHost:8888", "https://*.lab.example"}, .hosts = {}});
  for (const char* page : {"/", "/travel/fork"}) {
    EXPECT_EQ(alone.get(page, frame).status, 403u) << page;
    EXPECT_TRUE(alone.get(page).header("Content-Security-Policy").ends_with("; frame-ancestors 'none'")) << page;
    EXPECT_EQ(alone.get(page).header("Cross-Origin-Resource-Policy"), "") << page;
    const Answer answer = held.get(page, frame);
    EXPECT_EQ(answer.status, 200u) << page;
    EXPECT_TRUE(answer.header("Content-Security-Policy")
                    .ends_with("; frame-ancestors http://localhost:8888 https://*.lab.example"))
        << answer.header("Content-Security-Policy");
    EXPECT_EQ(answer.header("Cross-Origin-Resource-Policy"), "cross-origin");
  }
  EXPECT_EQ(held.get("/v1/sets", frame).status, 403u) << "no page";
  std::map<std::string, std::string> script = frame;
  script["sec-fetch-mode"] = "no-cors";
  script["sec-fetch-dest"] = "script";
  EXPECT_EQ(held.get("/", script).status, 403u);
  for (const char* wrong : {"localhost:8888", "http://a/b", "http://a; script-src *", "http://a,http://b", "'self'", "",
                            "http://*", "http://*:*", "http://a.*", "http://a\r\nX-B: 1", "http://[::1]:8888"})
    EXPECT_THROW(Access({.people = {}, .origins = {}, .frame_origins = {wrong}, .hosts = {}}), UsageError) << wrong;
  EXPECT_THROW(Access({.people = {}, .origins = {"http://localhost:*"}, .hosts = {}}), UsageError);
}

}  // namespace
}  // namespace filiform::tools
