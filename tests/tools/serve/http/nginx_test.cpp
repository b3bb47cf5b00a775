// tools/serve/operate/nginx.conf with the real nginx in front of the server: TLS, tokens, the cache.
#include "tests/support/folders.h"
#include "tests/support/sanitized.h"
#include "tests/support/servers/free_port.h"
#include "tests/support/servers/served_column.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <optional>
#include <regex>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

const char* const kProxyToken = "0123456789abcdef0123";

class Nginx : public test::ServedColumn {
 protected:
  Nginx() : ServedColumn(2) {}
  void SetUp() override {
    if (test::kSanitized) GTEST_SKIP() << "another program's configuration, once is enough";
    if (std::system("command -v nginx >/dev/null && command -v openssl >/dev/null && command -v curl >/dev/null") != 0)
      GTEST_SKIP() << "needs nginx, openssl and curl";
    test::writeBytes(folder_ / "token", std::string(kProxyToken) + "\n");
    ServedColumn::SetUp();
    start({"--token-file", folder_ / "token", "--host", "tiles.example", "--proxy", "127.0.0.1"});
    ASSERT_EQ(shell("cd " + folder_.path() +
                    " && openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=tiles.example "
                    "-addext subjectAltName=DNS:tiles.example,IP:127.0.0.1 "
                    "-keyout key.pem -out certificate.pem 2>/dev/null"),
              "");
    // Another port and folders of the test; the rest is the file as it is.
    std::string text = test::readBytes(test::inSource("tools/serve/operate/nginx.conf"));
    port_ = test::freePort();
    const auto replace = [&text](const std::string& from, const std::string& to) {
      text = std::regex_replace(text, std::regex(from), to);
    };
    replace("/etc/ssl/filiform|/var/log/nginx|/var/cache/nginx", folder_.path());
    if (::geteuid() == 0)
      replace("worker_processes auto;", "user root root;\nworker_processes 1;");  // the folder is ours alone
    replace("listen 443", "listen 127.0.0.1:" + std::to_string(port_));
    replace("127.0.0.1:7878", "127.0.0.1:" + std::to_string(server_->port()));
    for (const char* kind : {"client_body", "proxy", "fastcgi", "uwsgi", "scgi"})
      replace("\nhttp \\{", "\nhttp {\n  " + std::string(kind) + "_temp_path " + folder_ / kind + ";");
    test::writeBytes(folder_ / "nginx.conf", text);
    ASSERT_EQ(shell(nginx("")), "") << text;
  }
  void TearDown() override {
    if (port_ != 0) shell(nginx(" -s stop"));
  }
  std::string nginx(const std::string& more) const {
    return "nginx -p " + folder_.path() + " -c nginx.conf -e " + folder_ / "nginx.err" + " -g 'pid " +
           folder_ / "nginx.pid" + ";'" + more + " 2>&1";
  }
  std::string curl(const std::string& path, const std::string& options = "") const {
    const std::string address = "https://tiles.example:" + std::to_string(port_);
    return shell("curl -s --cacert " + folder_ / "certificate.pem" + " --resolve tiles.example:" +
                 std::to_string(port_) + ":127.0.0.1 " + options + " '" + address + path + "'");
  }
  int port_ = 0;
};

TEST_F(Nginx, PassesTokensOnAndKeepsPartsForThoseWhoMayRead) {
  const std::string token = std::string("-H 'Authorization: Bearer ") + kProxyToken + "'";
  EXPECT_EQ(curl("/healthz"), "ok\n");
  EXPECT_EQ(curl("/v1/sets", "-o /dev/null -w '%{http_code}'"), "401");
  EXPECT_NE(curl("/v1/sets", token).find("\"name\":\"t\""), std::string::npos);
  EXPECT_EQ(curl("/v1/sets", token + " -H 'Host: evil.example' -o /dev/null -w '%{http_code}'"), "421");
  const std::string page = curl("/", token);
  const std::size_t door = page.find("precomputed://https://tiles.example/precomputed/~");
  ASSERT_NE(door, std::string::npos) << page;
  const std::string capability = page.substr(door + 49, 32);
  EXPECT_EQ(curl("/precomputed/~" + capability + "/t/info", "-o /dev/null -w '%{http_code}'"), "200");
  EXPECT_EQ(curl("/precomputed/~x/t/info", "-o /dev/null -w '%{http_code}'"), "401");
  std::string revision = curl("/v1/sets/t/files/CURRENT", token);
  revision.resize(18);
  const std::string part = "/v1/sets/t/files/" + revision + "/directory.bin/0-7";
  const std::string bytes = test::readBytes(folder_ / ("t.fil/" + revision + "/directory.bin")).substr(0, 8);
  EXPECT_EQ(curl(part, token), bytes);
  EXPECT_EQ(curl(part, "-o /dev/null -w '%{http_code}'"), "401") << "not from the cache";
  server_->signal(SIGKILL);
  server_->wait();
  EXPECT_EQ(curl(part, token), bytes) << "from the cache";
  const std::string logged = test::readBytes(folder_ / "filiform.log") + test::readBytes(folder_ / "err");
  EXPECT_EQ(logged.find(kProxyToken), std::string::npos);
  EXPECT_EQ(logged.find(capability), std::string::npos);
  EXPECT_NE(logged.find("/precomputed/~.../t/info"), std::string::npos) << logged;
}

TEST_F(Nginx, PassesSessionsAndTheClientOn) {
  const std::string token = std::string("-H 'Authorization: Bearer ") + kProxyToken + "'";
  const std::string upgrade = token +
                              " --http1.1 --max-time 2 -o /dev/null -w '%{http_code} ' -H 'Connection: Upgrade' "
                              "-H 'Upgrade: websocket' -H 'Sec-WebSocket-Version: 13' "
                              "-H 'Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=='";
  std::string revision = curl("/v1/sets/t/files/CURRENT", token);
  revision.resize(18);
  EXPECT_EQ(curl("/v1/session", upgrade).substr(0, 4), "101 ");
  EXPECT_EQ(curl("/v1/sets/t/desks/d1?revision=" + revision, upgrade).substr(0, 4), "101 ");
  const std::string head = curl("/?token=" + std::string(kProxyToken), "-o /dev/null -D -");
  EXPECT_NE(head.find("et-cookie: __Host-filiform="), std::string::npos) << head;
  EXPECT_NE(head.find("; Secure"), std::string::npos) << head;
  curl("/v1/sets?of=another", token + " --interface 127.0.0.3");
  bool logged = false;  // the line may come after the answer
  for (int i = 0; i < 200 && !logged; ++i, std::this_thread::sleep_for(std::chrono::milliseconds(20)))
    logged = test::readBytes(folder_ / "err").find(" 127.0.0.3 GET /v1/sets?of=another") != std::string::npos;
  EXPECT_TRUE(logged);
  EXPECT_NE(curl("/v1/openapi.json", token + " --compressed -o /dev/null -D -").find("ontent-encoding: gzip"),
            std::string::npos);
}

// Each command as a process, over TLS, gives what it gives of the folder.
TEST_F(Nginx, EveryCommandReadsThroughIt) {
  const std::string address = "https://127.0.0.1:" + std::to_string(port_) + "/v1/sets/t", set = folder_ / "t.fil";
  const std::string variables = "SSL_CERT_FILE=" + folder_ / "certificate.pem" + " FILIFORM_TOKEN=" + kProxyToken;
  const std::string cells = test::runFiliform({"cells", set, "--tsv"}).out;
  const std::size_t row = cells.find('\n') + 1, name = cells.find('\t', row) + 1;
  const std::string cell = cells.substr(name, cells.find('\t', name) - name);
  const std::vector<std::vector<std::string>> commands{
      {"info", "SET", "--json"},
      {"cells", "SET", "--json"},
      {"nearest", "SET", "0", "700", "0", "--k", "5", "--json"},
      {"export", "SET", "--cell", cell, "-o", "-"},
      {"navigate", "SET", "--seconds", "0.2", "--budget", "16MiB", "--json"},
      {"verify", "SET"}};
  for (const std::vector<std::string>& words : commands) {
    SCOPED_TRACE(words.front());
    std::vector<std::string> local = words, remote = words;
    local[1] = set, remote[1] = address;
    const test::Outcome here = test::runFiliform(local);
    const test::Outcome there = test::runFiliformInShell(variables + " \"$@\"", remote);
    EXPECT_EQ(here.exit_code, 0) << here.err;
    EXPECT_EQ(there.exit_code, 0) << there.err;
    EXPECT_EQ(test::withoutNetwork(std::regex_replace(there.out, std::regex(address), set)),
              test::withoutNetwork(here.out));
  }
  const test::Outcome stranger = test::runFiliformInShell("FILIFORM_TOKEN=x \"$@\"", {"info", address});
  EXPECT_EQ(stranger.exit_code, 3);
  EXPECT_NE(stranger.err.find("certificate"), std::string::npos) << stranger.err;
}

}  // namespace
}  // namespace filiform
