// `filiform serve` as a process with named people: the file of --tokens, the header of a proxy, the log.
#include "tests/support/servers/served_column.h"
#include "tests/support/servers/server_process.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using namespace std::chrono_literals;
using test::fetch;
using test::runFiliform;

const std::string kTokenOfAnn = "0123456789abcdef-ann", kTokenOfBen = "0123456789abcdef-ben";

class ServerPeople : public test::ServedColumn {
 protected:
  ServerPeople() : ServedColumn(1) {}
  std::string tokenOf(const std::string& name, const std::string& token, const std::string& more = "") const {
    return "[[token]]\nname = \"" + name + "\"\ntoken = \"" + token + "\"\n" + more;
  }
  void write(const std::string& text) const {
    test::writeBytes(file_, text);
    std::filesystem::permissions(file_, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  }
  unsigned statusOf(const std::string& token, const std::string& target = "/v1/sets") const {
    return fetch(server_->port(), target, {{"Authorization", "Bearer " + token}}).status;
  }
  static bool soon(const std::function<bool()>& check) {
    for (int i = 0; i < 400; ++i, std::this_thread::sleep_for(50ms))
      if (check()) return true;
    return false;
  }
  std::string log() const { return test::readBytes(folder_ / "err"); }
  bool logHas(const std::string& text) const { return log().find(text) != std::string::npos; }
  const std::string file_ = folder_ / "people.toml";
};

TEST_F(ServerPeople, TheFileIsReadAgainUnlessItIsDamaged) {
  write(tokenOf("ann", kTokenOfAnn) + tokenOf("ben", kTokenOfBen));
  start({"--tokens", file_});
  EXPECT_EQ(statusOf(kTokenOfAnn), 200u);
  EXPECT_EQ(statusOf(kTokenOfAnn, "/metrics"), 403u);
  EXPECT_FALSE(logHas("chmod"));
  write(tokenOf("ben", kTokenOfBen, "scopes = [\"read\", \"metrics\"]\n"));
  EXPECT_TRUE(soon([&] { return statusOf(kTokenOfAnn) == 401u; }));
  EXPECT_EQ(statusOf(kTokenOfBen, "/metrics"), 200u);
  write("[[token]]\nname = \"ann\"\ntoken = 7\n");
  EXPECT_TRUE(soon([&] { return logHas("line 3"); })) << log();
  EXPECT_TRUE(logHas("the old one stays")) << log();
  EXPECT_EQ(statusOf(kTokenOfBen), 200u);
  test::writeBytes(file_, tokenOf("ann", kTokenOfAnn));
  std::filesystem::permissions(file_, std::filesystem::perms::others_read, std::filesystem::perm_options::add);
  EXPECT_TRUE(soon([&] { return statusOf(kTokenOfAnn) == 200u && logHas("chmod 600"); })) << log();
  const std::size_t before = log().size();
  server_->signal(SIGHUP);
  EXPECT_TRUE(soon([&] { return log().find("--tokens was read again", before) != std::string::npos; })) << log();
  server_->signal(SIGTERM);
  EXPECT_EQ(server_->wait(), 0);
  EXPECT_TRUE(logHas(" user=ann\n") && logHas(" user=ben\n")) << log();
  EXPECT_FALSE(logHas(kTokenOfAnn) || logHas(kTokenOfBen)) << "a token in the log";
}

TEST_F(ServerPeople, AQuotaTellsWhenToAskAgain) {
  write(tokenOf("ann", kTokenOfAnn, "requests-per-minute = 2\n"));
  start({"--tokens", file_});
  EXPECT_EQ(statusOf(kTokenOfAnn), 200u);
  EXPECT_EQ(statusOf(kTokenOfAnn), 200u);
  const auto refused = fetch(server_->port(), "/v1/sets", {{"Authorization", "Bearer " + kTokenOfAnn}});
  EXPECT_EQ(refused.status, 429u);
  EXPECT_NE(refused.head.find("\r\nRetry-After: "), std::string::npos) << refused.head;
  EXPECT_EQ(refused.head.find("\r\nRetry-After: "), refused.head.rfind("\r\nRetry-After: "));
}

// Clients of several addresses of loopback: 127.0.0.9 is the proxy.
TEST_F(ServerPeople, OnlyAStatedProxyNamesTheUser) {
  if (std::system("command -v curl >/dev/null") != 0) GTEST_SKIP() << "needs curl";
  start({"--proxy", "127.0.0.9", "--user-header", "X-User"});
  const auto status = [&](const std::string& from, const std::string& headers) {
    return shell("curl -s -o /dev/null -w '%{http_code}' --interface " + from + " " + headers + " " +
                 server_->address() + "/v1/sets");
  };
  EXPECT_EQ(status("127.0.0.9", "-H 'X-User: ann@lab.example'"), "200");
  EXPECT_EQ(status("127.0.0.9", "-H 'x-user: ben'"), "200");
  EXPECT_EQ(status("127.0.0.9", ""), "401");
  EXPECT_EQ(status("127.0.0.9", "-H 'X-User;'"), "401") << "an empty name is none";
  EXPECT_EQ(status("127.0.0.9", "-H 'X-User: ann' -H 'X-User: ben'"), "400");
  EXPECT_EQ(status("127.0.0.9", "-H 'X-User: ann lee'"), "400");
  EXPECT_EQ(status("127.0.0.8", "-H 'X-User: ann@lab.example'"), "401") << "another address is not believed";
  EXPECT_EQ(status("127.0.0.8", "-H 'X-User: ann' -H 'X-User: ben' -H 'X-Forwarded-For: 127.0.0.9'"), "401");
  EXPECT_TRUE(soon([&] { return logHas(" user=ann@lab.example\n"); })) << log();
}

TEST_F(ServerPeople, WithoutATokenTheHeaderNamesThemAlone) {
  if (std::system("command -v curl >/dev/null") != 0) GTEST_SKIP() << "needs curl";
  start({"--proxy", "127.0.0.1", "--user-header", "X-User", "--no-token"});
  EXPECT_EQ(fetch(server_->port(), "/v1/sets", {{"X-User", "ann"}}).status, 200u);
  EXPECT_EQ(fetch(server_->port(), "/v1/sets").status, 200u);
  EXPECT_TRUE(soon([&] { return logHas(" user=ann\n"); })) << log();
}

TEST_F(ServerPeople, MistakesAreRefusedAtTheStart) {
  const auto expect = [&](std::vector<std::string> options, const std::string& said) {
    options.insert(options.begin(), {"serve", set_, "--listen", "127.0.0.1:0"});
    const test::Outcome refused = runFiliform(options);
    EXPECT_EQ(refused.exit_code, 2) << said;
    EXPECT_TRUE(refused.oneLineOnStderr()) << refused.err;
    EXPECT_NE(refused.err.find(said), std::string::npos) << refused.err;
  };
  write(tokenOf("ann", kTokenOfAnn) + "[[user]]\nname = \"*\"\n");
  expect({"--tokens", file_}, "--user-header");
  expect({"--user-header", "X-User"}, "--proxy");
  expect({"--user-header", "X User", "--proxy", "127.0.0.1"}, "X-User");
  expect({"--tokens", file_, "--token-file", file_}, "--token-file");
  expect({"--tokens", file_, "--no-token"}, "--no-token");
  write("");
  expect({"--tokens", file_}, "has no [[token]]");
  test::writeBytes(folder_ / "sets.toml", "[t2]\naddress = \"t.fil\"\nreaders = [\"ann\"]\n");
  expect({"--catalogue", folder_ / "sets.toml", "--no-token"}, "--tokens");
  expect({"--catalogue", folder_ / "sets.toml"}, "--tokens");  // its one token has no name
}

}  // namespace
}  // namespace filiform
