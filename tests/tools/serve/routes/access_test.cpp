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
  EXPECT_EQ(sets.get("/v1/sets", {{"cookie", "a=b; filiform_token=" + kToken + "; c=d"}}).status, 200u);
  for (const std::string& wrong : {std::string(), kToken + "0", kToken.substr(1), std::string("x"), kToken + kToken}) {
    EXPECT_EQ(sets.get("/v1/sets", {{"authorization", "Bearer " + wrong}}).status, 401u) << wrong;
    EXPECT_EQ(sets.get("/v1/sets", {{"cookie", "filiform_token=" + wrong}}).status, 401u) << wrong;
  }
  EXPECT_EQ(sets.get("/v1/sets?token=" + kToken).status, 401u) << "only the page takes it in the URL";
  EXPECT_FALSE(Access({}).isToken(""));
}

TEST(Access, ThePageTurnsTheTokenIntoACookie) {
  const test::ServedSets sets({.token = kToken, .origins = {}, .hosts = {}});
  const Answer right = sets.get("/?token=" + kToken);
  EXPECT_EQ(right.status, 303u);
  EXPECT_EQ(right.header("Location"), "/");
  EXPECT_EQ(right.header("Set-Cookie"), "filiform_token=" + kToken + "; HttpOnly; SameSite=Strict; Path=/");
  const Answer wrong = sets.get("/?token=wrong");
  EXPECT_EQ(wrong.status, 401u);
  EXPECT_EQ(wrong.header("Set-Cookie"), "");
}

TEST(Access, TokensAreReadFromTheFirstLine) {
  const test::TempFolder folder;
  const auto read = [&](const std::string& bytes) {
    test::writeBytes(folder / "token", bytes);
    return readToken(folder / "token");
  };
  EXPECT_EQ(read(kToken), kToken);
  EXPECT_EQ(read("\xEF\xBB\xBF" + kToken + " \r\nmore\n"), kToken);
  for (const std::string wrong : {"", "short", "\n0123456789abcdef0123", "0123456789abcdef 0123",
                                  "0123456789abcdef\t0123", "0123456789abcdef;0123"})
    EXPECT_THROW(read(wrong), UsageError) << wrong;
  EXPECT_THROW(readToken(folder / "absent"), IoError);
}

}  // namespace
}  // namespace filiform::tools
