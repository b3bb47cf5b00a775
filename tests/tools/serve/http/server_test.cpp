// filiform serve as a process: clients of several kinds, hostile ones too, and its end.
#include "tests/support/campaign.h"
#include "tests/support/sanitized.h"
#include "tests/support/servers/served_column.h"
#include "tests/support/servers/server_process.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iomanip>
#include <iterator>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using namespace std::chrono_literals;
using test::fetch;
using test::RawClient;
using test::runFiliform;

class Server : public test::ServedColumn {
 protected:
  // What a shell line prints; "$U" stands for the address.
  std::string shell(const std::string& line) const {
    return ServedColumn::shell("U=" + server_->address() + "; " + line);
  }
};

TEST_F(Server, CurlReadsPageQueriesAndRanges) {
  if (std::system("command -v curl >/dev/null 2>&1") != 0) GTEST_SKIP() << "needs curl";
  start();
  EXPECT_EQ(shell("curl -sf $U/healthz"), "ok\n");
  EXPECT_NE(shell("curl -sf $U/").find("<h2>t</h2>"), std::string::npos);
  const auto row = nlohmann::json::parse(shell("curl -sf \"$U/v1/sets/t/nearest?at=0,0,0\"")).at("rows").at(0);
  EXPECT_TRUE(row.contains("sample"));
  const std::string current = shell("curl -sf $U/v1/sets/t/files/CURRENT");
  const std::string revision = current.substr(0, current.find('\n'));
  const std::string bytes = test::readBytes(set_ + "/" + revision + "/directory.bin");
  const std::string file = " $U/v1/sets/t/files/" + revision + "/directory.bin";
  EXPECT_EQ(shell("curl -sf" + file), bytes);
  EXPECT_EQ(shell("curl -sf -r 8-15" + file), bytes.substr(8, 8));
  EXPECT_EQ(shell("curl -sf" + file + "/8-15"), bytes.substr(8, 8));
  EXPECT_NE(shell("curl -sI" + file).find("Content-Length: " + std::to_string(bytes.size())), std::string::npos);
  EXPECT_EQ(
      shell("curl -s -o /dev/null -w '%{http_code}' -H 'Content-Encoding: gzip' --data-binary x $U/v1/sets/t/nearest"),
      "415");
}

TEST_F(Server, PythonReadsStructuredArrays) {
  if (std::system("command -v python3 >/dev/null 2>&1") != 0) GTEST_SKIP() << "needs python3";
  start();
  test::writeBytes(folder_ / "client.py", R"(
import ast, json, struct, sys, urllib.request
url = sys.argv[1] + '/v1/sets/t/nearest?k=2'
points = [(0.0, 0.0, 0.0), (50.0, 400.0, -20.0)]
header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }\n"
body = b'\x93NUMPY\x01\x00' + struct.pack('<H', len(header)) + header + b''.join(struct.pack('<3d', *p) for p in points)
def ask(data, content, accept):
    request = urllib.request.Request(url, data, {'Content-Type': content, 'Accept': accept})
    return urllib.request.urlopen(request).read()
npy = ask(body, 'application/x-npy', 'application/x-npy')
length, = struct.unpack_from('<H', npy, 8)
described = ast.literal_eval(npy[10:10 + length].decode())
form = '<' + ''.join({'<u4': 'I', '<i4': 'i', '<f8': 'd', '<f4': 'f', '<i8': 'q', '?': '?'}[kind] for _, kind in described['descr'])
names = [name for name, _ in described['descr']]
rows = [dict(zip(names, row)) for row in struct.iter_unpack(form, npy[10 + length:])]
wanted = json.loads(ask(json.dumps({'points': points}).encode(), 'application/json', '*/*'))['rows']
assert described['shape'] == (4,) and len(wanted) == 4
for row, want in zip(rows, wanted):
    assert all(row[name] == want[name] for name in names if name not in ('cell', 'type', 'radius')), (row, want)
    assert row['radius'] == want['radius'] and isinstance(want['type'], str), (row, want)
print('equal')
)");
  EXPECT_EQ(shell("python3 " + folder_ / "client.py" + " $U"), "equal\n");
}

// Rows of the program and of the service are the same text, but for tiles_read.
TEST_F(Server, NearestGivesTheBytesOfTheProgram) {
  start();
  const int batches = test::kSanitized ? 1 : 10, count = test::kSanitized ? 500 : 10'000;
  std::mt19937_64 random(29);
  std::uniform_real_distribution<double> along(-500, 1500);
  int rows = 0;
  for (int batch = 0; batch < batches; ++batch) {  // smaller requests, for the limit of time on a busy machine
    std::ostringstream lines, json;
    lines << std::setprecision(17);
    json << std::setprecision(17) << "{\"points\":[";
    for (int i = 0; i < count; ++i) {
      const double x = along(random), y = along(random), z = along(random);
      lines << x << ' ' << y << ' ' << z << '\n';
      json << (i > 0 ? "," : "") << '[' << x << ',' << y << ',' << z << ']';
    }
    json << "]}";
    const std::string program = runFiliform({"nearest", set_, "--points", "-", "--json"}, lines.str()).out;
    const auto reply = fetch(server_->port(), "/v1/sets/t/nearest", {{"Content-Type", "application/json"}}, json.str());
    ASSERT_EQ(reply.status, 200u) << reply.body.substr(0, 300);
    std::istringstream ours(reply.body), theirs(program);
    std::string our, their;
    std::getline(ours, our), std::getline(theirs, their);
    EXPECT_EQ(our, "{\"truncated\":false,\"rows\":[");
    EXPECT_EQ(their, "[");
    while (std::getline(ours, our) && std::getline(theirs, their) && our != "]}") {
      const std::size_t at = their.find(",\"tiles_read\":");
      ASSERT_NE(at, std::string::npos) << their;
      their.erase(at, their.find_first_of(",}", at + 1) - at);
      ASSERT_EQ(our, their);
      ++rows;
    }
  }
  EXPECT_EQ(rows, batches * count);
  if (test::wholeCampaign()) test::tell("nearest over HTTP: " + std::to_string(rows) + " rows equal the program's");
}

TEST_F(Server, OnlyTheTokenOpens) {
  test::writeBytes(folder_ / "token", "0123456789abcdef0123\n");
  start({"--token-file", folder_ / "token"});
  const std::uint16_t port = server_->port();
  EXPECT_EQ(fetch(port, "/v1/sets").status, 401u);
  EXPECT_EQ(fetch(port, "/v1/sets", {{"Authorization", "Bearer 0123456789abcdef0124"}}).status, 401u);
  EXPECT_EQ(fetch(port, "/v1/sets", {{"Authorization", "Bearer 0123456789abcdef0123"}}).status, 200u);
  EXPECT_EQ(fetch(port, "/?token=0123456789abcdef0123").status, 303u);
  // The body is not read before the token.
  RawClient client(port);
  client.send("POST /v1/sets/t/nearest HTTP/1.1\r\nHost: localhost\r\nContent-Length: 8000000\r\n\r\n");
  EXPECT_EQ(client.read().status, 401u);
  server_->signal(SIGTERM);
  EXPECT_EQ(server_->wait(), 0);
  EXPECT_EQ(test::readBytes(folder_ / "err").find("0123456789abcdef"), std::string::npos) << "a token in the log";
}

TEST_F(Server, MakesATokenByItself) {
  const test::StartedProcess server({test::filiformProgram().string(), "serve", set_, "--listen", "127.0.0.1:0"},
                                    folder_ / "err");
  const std::string &link = server.line(), root = "/?token=";
  const std::size_t at = link.find(root);
  ASSERT_NE(at, std::string::npos) << link;
  const std::string token = link.substr(at + root.size());
  const auto port = static_cast<std::uint16_t>(std::stoi(link.substr(link.rfind(':', at) + 1)));
  EXPECT_EQ(token.size(), 32u);
  EXPECT_EQ(fetch(port, "/v1/sets").status, 401u);
  EXPECT_EQ(fetch(port, "/v1/sets", {{"Authorization", "Bearer " + token}}).status, 200u);
  EXPECT_EQ(fetch(port, link.substr(at)).status, 303u);
  const std::string told = test::readBytes(folder_ / "err");
  EXPECT_NE(told.find("--no-token"), std::string::npos) << told;
  EXPECT_EQ(told.find(token), std::string::npos) << "the token in the log";
}

TEST_F(Server, OtherAddressesNeedAToken) {
  for (const char* address : {"0.0.0.0:0", "[::]:0"}) {
    const test::Outcome refused = runFiliform({"serve", set_, "--no-token", "--listen", address});
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_EQ(refused.out, "");
    EXPECT_TRUE(refused.oneLineOnStderr()) << refused.err;
    EXPECT_NE(refused.err.find("--token-file"), std::string::npos) << refused.err;
  }
  EXPECT_EQ(runFiliform({"serve", set_, "--listen", "127.0.0.1"}).exit_code, 2);
  EXPECT_EQ(runFiliform({"serve", set_, "--listen", "127.0.0.1:99999"}).exit_code, 2);
  EXPECT_EQ(runFiliform({"serve", folder_ / "absent.fil"}).exit_code, 3);
  start();
  EXPECT_EQ(runFiliform({"serve", set_, "--listen", "127.0.0.1:" + std::to_string(server_->port())}).exit_code, 3);
}

TEST_F(Server, LargeRequestsAreRefusedBeforeTheyAreRead) {
  start();
  RawClient body(server_->port());
  body.send("POST /v1/sets/t/nearest HTTP/1.1\r\nHost: localhost\r\nContent-Length: 8388609\r\n\r\n");
  EXPECT_EQ(body.read().status, 413u);
  RawClient chunked(server_->port());
  chunked.send(
      "POST /v1/sets/t/nearest HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
      "Transfer-Encoding: chunked\r\n\r\n");
  const std::string chunk = "100000\r\n" + std::string(1 << 20, ' ') + "\r\n";
  for (int i = 0; i < 9 && chunked.send(chunk); ++i) {
  }
  EXPECT_EQ(chunked.read().status, 413u);
  RawClient header(server_->port());
  header.send("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(20000, 'x') + "\r\n\r\n");
  EXPECT_EQ(header.read().status, 431u);
  RawClient twice(server_->port());
  twice.send("GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil\r\n\r\n");
  EXPECT_EQ(twice.read().status, 400u);
  RawClient waiting(server_->port());
  waiting.send(
      "POST /v1/sets/t/nearest HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
      "Content-Length: 13\r\nExpect: 100-continue\r\n\r\n");
  EXPECT_EQ(waiting.readAll(300ms), "HTTP/1.1 100 Continue\r\n\r\n");
  waiting.send("{\"points\":[]}");
  EXPECT_EQ(waiting.read().status, 200u);
}

TEST_F(Server, MalformedRequestsHarmNobody) {
  start({"--max-clients", "50"});
  const std::string right =
      "POST /v1/sets/t/nearest?k=2 HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
      "Content-Length: 24\r\n\r\n{\"points\": [[1, 2, 3]]}\n";
  const int count = test::kSanitized ? 500 : 10'000;
  std::mt19937_64 random(31);
  for (int i = 0; i < count; ++i) {
    std::string bytes = right;
    for (std::size_t change = random() % 6; change > 0; --change) {
      const std::size_t at = random() % bytes.size();
      if (random() % 3 == 0)
        bytes.erase(at, random() % 20);
      else if (random() % 2 == 0)
        bytes.insert(at, std::string(random() % 40, static_cast<char>(random())));
      else
        bytes[at] = static_cast<char>(random());
    }
    RawClient client(server_->port());
    client.send(bytes);
    if (i % 100 != 0) continue;
    EXPECT_EQ(fetch(server_->port(), "/healthz").status, 200u) << i;
  }
  EXPECT_EQ(fetch(server_->port(), "/v1/sets/t/nearest?at=1,2,3").status, 200u);
  if (test::wholeCampaign()) test::tell("malformed requests: " + std::to_string(count));
  server_->signal(SIGTERM);
  EXPECT_EQ(server_->wait(), 0) << test::readBytes(folder_ / "err");
}

TEST_F(Server, IdleAndSlowClientsDoNotLockOthersOut) {
  start({"--max-clients", "8"});
  std::vector<std::unique_ptr<RawClient>> idle;
  for (int i = 0; i < 30; ++i) idle.push_back(std::make_unique<RawClient>(server_->port()));
  EXPECT_EQ(fetch(server_->port(), "/healthz").status, 200u);
  // A connection without a whole request gives way.
  std::vector<std::unique_ptr<RawClient>> slow;
  for (int i = 0; i < 30; ++i) {
    slow.push_back(std::make_unique<RawClient>(server_->port()));
    slow.back()->send(i % 2 == 0 ? "G" : "GET / HTTP/1.1\r\nHost");
  }
  EXPECT_EQ(fetch(server_->port(), "/healthz").status, 200u);
  EXPECT_EQ(fetch(server_->port(), "/v1/sets/t/nearest?at=1,2,3").status, 200u);
}

// Clients that do not read their answers keep all places.
TEST_F(Server, HealthIsAnsweredBeyondTheMostClients) {
  start({"--max-clients", "4"});
  const std::string current = fetch(server_->port(), "/v1/sets/t/files/CURRENT").body;
  const std::string revision = current.substr(0, current.find('\n'));
  std::string file;
  std::uintmax_t most = 0;
  for (const auto& entry : std::filesystem::directory_iterator(set_ + "/" + revision))
    if (entry.file_size() > most) most = entry.file_size(), file = entry.path().filename().string();
  std::vector<std::unique_ptr<RawClient>> readers;
  for (int i = 0; i < 4; ++i) {
    readers.push_back(std::make_unique<RawClient>(server_->port(), 4096));
    std::string many;
    for (int k = 0; k < 20; ++k)
      many += "GET /v1/sets/t/files/" + revision + "/" + file + " HTTP/1.1\r\nHost: localhost\r\n\r\n";
    readers.back()->send(many);
  }
  unsigned status = 0;
  std::string head;
  for (int i = 0; i < 100 && status != 503; ++i) {  // until all of them are being answered
    const auto reply = fetch(server_->port(), "/v1/sets/t");
    status = reply.status, head = reply.head;
    std::this_thread::sleep_for(20ms);
  }
  EXPECT_EQ(status, 503u) << most << " bytes are sent at once";
  EXPECT_NE(head.find("Retry-After: 1"), std::string::npos) << head;
  for (const char* target : {"/healthz", "/readyz", "/metrics"})
    EXPECT_EQ(fetch(server_->port(), target).status, 200u) << target;
}

TEST_F(Server, WorkEndsWhenItsClientLeaves) {
  start({"--threads", "1"});
  std::string points = "{\"k\":100,\"points\":[[0,0,0]";
  for (int i = 1; i < 9000; ++i) points += ",[" + std::to_string(i % 700) + ",100,50]";
  points += "]}";
  const std::string request =
      "POST /v1/sets/t/nearest HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: " +
      std::to_string(points.size()) + "\r\n\r\n" + points;
  for (int i = 0; i < 20; ++i) RawClient(server_->port()).send(request);
  std::string metrics;
  for (int i = 0; i < 1000 && (metrics.find("filiform_left_answers_total 20\n") == std::string::npos ||
                               metrics.find("filiform_waiting_requests 0\n") == std::string::npos);
       ++i) {
    std::this_thread::sleep_for(20ms);
    metrics = fetch(server_->port(), "/metrics").body;
  }
  EXPECT_NE(metrics.find("filiform_left_answers_total 20\n"), std::string::npos) << metrics;
  EXPECT_NE(metrics.find("filiform_waiting_requests 0\n"), std::string::npos) << metrics;
}

TEST_F(Server, RequestsInOnePacketAreAnsweredInOrder) {
  start();
  RawClient client(server_->port());
  std::string many;
  for (int i = 0; i < 20; ++i)
    many += "GET /v1/sets/t/nearest?at=" + std::to_string(i * 50) + ",0,0 HTTP/1.1\r\nHost: localhost\r\n\r\n";
  client.send(many);
  for (int i = 0; i < 20; ++i) {
    const auto reply = client.read();
    EXPECT_EQ(reply.body, fetch(server_->port(), "/v1/sets/t/nearest?at=" + std::to_string(i * 50) + ",0,0").body);
  }
}

TEST_F(Server, SigtermSendsTheAnswersInWork) {
  start();
  std::string points = "{\"k\":10,\"points\":[[0,0,0]";
  for (int i = 1; i < (test::kSanitized ? 500 : 5000); ++i) points += ",[" + std::to_string(i % 700) + ",100,50]";
  points += "]}";
  RawClient client(server_->port()), quiet(server_->port());
  client.send(
      "POST /v1/sets/t/nearest HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: " +
      std::to_string(points.size()) + "\r\n\r\n" + points);
  std::this_thread::sleep_for(100ms);
  server_->signal(SIGTERM);
  const auto reply = client.read();
  EXPECT_EQ(reply.status, 200u);
  EXPECT_TRUE(nlohmann::json::accept(reply.body));
  EXPECT_EQ(quiet.readAll(5s), "");
  EXPECT_EQ(server_->wait(), 0) << test::readBytes(folder_ / "err");
}

TEST_F(Server, AfterAKillTheSetIsAsBefore) {
  start();
  EXPECT_EQ(fetch(server_->port(), "/v1/sets/t").status, 200u);
  server_->signal(SIGKILL);
  EXPECT_EQ(server_->wait(), 128 + SIGKILL);
  EXPECT_EQ(runFiliform({"verify", set_, "--deep"}).exit_code, 0);
  start();
  EXPECT_EQ(fetch(server_->port(), "/v1/sets/t").status, 200u);
}

TEST_F(Server, AThousandReconnectsLeaveNothing) {
  start();
  const auto openFiles = [&] {
    const std::filesystem::path files = "/proc/" + std::to_string(server_->processId()) + "/fd";
    return std::distance(std::filesystem::directory_iterator(files), std::filesystem::directory_iterator());
  };
  const std::string answer = fetch(server_->port(), "/v1/sets/t/nearest?at=1,2,3").body;
  const auto before = openFiles();
  const std::uint64_t bytes = server_->residentBytes();
  for (int i = 0; i < 1000; ++i) {
    RawClient client(server_->port());
    if (i % 2 == 0) {
      client.send("GET /v1/sets/t/nearest?at=1,2,3 HTTP/1.1\r\nHost: localhost\r\n\r\n");
      ASSERT_EQ(client.read().body, answer) << i;
    } else if (i % 4 == 1) {
      client.send("GET /v1/sets/t/nea");  // and leaves
    }
  }
  auto after = openFiles();
  for (int i = 0; i < 200 && (after = openFiles()) > before + 2; ++i) std::this_thread::sleep_for(50ms);
  EXPECT_LE(after, before + 2) << "connections that were left open";
  if (!test::kSanitized) {
    EXPECT_LT(server_->residentBytes(), bytes + (16 << 20));
  }
}

TEST_F(Server, ANewRevisionIsServedToNewRequests) {
  start();
  RawClient client(server_->port());
  ASSERT_EQ(runFiliform({"synth", folder_ / "u.zip", "--cells", "2", "--seed", "2"}).exit_code, 0);
  ASSERT_EQ(runFiliform({"ingest", folder_ / "u.zip", "-o", set_, "--force"}).exit_code, 0);
  unsigned cells = 0;
  for (int i = 0; i < 100 && cells != 2; ++i) {
    std::this_thread::sleep_for(100ms);
    client.send("GET /v1/sets/t HTTP/1.1\r\nHost: localhost\r\n\r\n");
    cells = nlohmann::json::parse(client.read().body).at("cells");
  }
  EXPECT_EQ(cells, 2u);
}

TEST_F(Server, ASetAtAnAddressIsReady) {
  start();
  const test::ServerProcess far({server_->address() + "/v1/sets/t"}, folder_ / "far.err");
  for (int i = 0; i < 10; ++i, std::this_thread::sleep_for(100ms))  // before and after the first look for a revision
    ASSERT_EQ(fetch(far.port(), "/readyz").status, 200u) << test::readBytes(folder_ / "far.err");
  EXPECT_EQ(fetch(far.port(), "/v1/sets/t").body, fetch(server_->port(), "/v1/sets/t").body);
}

TEST_F(Server, AFullDiskForTheLogHarmsNobody) {
  const test::Outcome outcome = test::runFiliformInShell(
      "shift 0; \"$@\" > " + folder_ / "address" + " 2> /dev/full & P=$!; for i in $(seq 100); do [ -s " +
          folder_ / "address" + " ] && break; sleep 0.1; done; U=$(head -1 " + folder_ / "address" +
          "); for i in 1 2 3; do python3 -c \"import sys, urllib.request; "
          "print(urllib.request.urlopen('$U/healthz').read())\"; "
          "done; kill -TERM $P; wait $P",
      {"serve", set_, "--no-token", "--listen", "127.0.0.1:0"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "b'ok\\n'\nb'ok\\n'\nb'ok\\n'\n");
}

}  // namespace
}  // namespace filiform
