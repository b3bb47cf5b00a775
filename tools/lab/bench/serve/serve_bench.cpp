// bench serve: the service on one thread that answers, beside the library on one thread, over the same set in memory.
#include "index/ingest/ingest.h"
#include "tools/lab/bench/index/dense_cells.h"
#include "tools/lab/bench/workloads.h"
#include "tools/serve/http/server.h"
#include "tools/serve/routes/routes.h"

#include <algorithm>
#include <arpa/inet.h>
#include <atomic>
#include <chrono>
#include <cstring>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <random>
#include <stdexcept>
#include <string>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

namespace filiform::tools {

namespace {

constexpr std::size_t kServedBatch = 1000;  // points of a request

// One connection that is kept.
class BenchClient {
 public:
  explicit BenchClient(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int at_once = 1;
    ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof at_once);
    if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
      throw std::runtime_error("bench serve: the server does not accept");
  }
  ~BenchClient() { ::close(socket_); }
  BenchClient(const BenchClient&) = delete;
  BenchClient& operator=(const BenchClient&) = delete;

  void send(const std::string& bytes) const {
    for (std::size_t sent = 0; sent < bytes.size();) {
      const ssize_t n = ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (n <= 0) throw std::runtime_error("bench serve: the connection ended");
      sent += static_cast<std::size_t>(n);
    }
  }
  // Reads one answer and returns the size of its content.
  std::size_t receive() {
    for (;;) {
      const std::size_t head = pending_.find("\r\n\r\n");
      if (head != std::string::npos) {
        if (!pending_.starts_with("HTTP/1.1 200")) throw std::runtime_error("bench serve: " + pending_.substr(0, 80));
        const std::size_t length = std::stoul(pending_.substr(pending_.find("Content-Length: ") + 16));
        if (pending_.size() >= head + 4 + length) {
          pending_.erase(0, head + 4 + length);
          return length;
        }
      }
      char bytes[65536];
      const ssize_t n = ::recv(socket_, bytes, sizeof bytes, 0);
      if (n <= 0) throw std::runtime_error("bench serve: the connection ended");
      pending_.append(bytes, static_cast<std::size_t>(n));
    }
  }

 private:
  int socket_;
  std::string pending_;
};

// The server with one thread that answers, on a thread of its own.
class BenchServer {
 public:
  BenchServer(const std::string& set, std::uint64_t budget_bytes)
      : shelf_(shelfEntries({set}), budget_bytes),
        server_(routes_, metrics_, options()),
        thread_([this] { server_.run(); }) {}
  ~BenchServer() {
    stop_ = true;
    thread_.join();
  }
  const ServedSet& served() const { return *shelf_.all().front(); }
  std::uint16_t port() const {
    return static_cast<std::uint16_t>(std::stoi(server_.address().substr(server_.address().rfind(':') + 1)));
  }

 private:
  ServerOptions options() const {
    ServerOptions options{.listen = "127.0.0.1:0", .threads = 1};
    options.stop = &stop_;
    return options;
  }
  std::atomic<bool> stop_{false};
  SetShelf shelf_;
  Access access_{AccessRules{}};
  Metrics metrics_;
  const Service service_{shelf_, access_, metrics_, ""};
  const Routes routes_{service_, [](const std::string&) {}};
  Server server_;
  std::thread thread_;
};

std::vector<Vector3d> pointsInCube(double side_um, std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> along(0, side_um);
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) points.emplace_back(along(random), along(random), along(random));
  return points;
}

// A POST of the points as an .npy array.
std::string requestOf(const std::string& set, const std::vector<Vector3d>& points) {
  std::string header =
      "{'descr': '<f8', 'fortran_order': False, 'shape': (" + std::to_string(points.size()) + ", 3), }\n";
  std::string body("\x93NUMPY\x01\x00", 8);
  body += {static_cast<char>(header.size()), '\0'};
  body += header;
  for (const Vector3d& p : points) {
    char raw[3 * sizeof(double)];
    std::memcpy(raw, p.data(), sizeof raw);
    body.append(raw, sizeof raw);
  }
  return "POST /v1/sets/" + set + "/nearest HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/x-npy\r\n" +
         "Accept: application/x-npy\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

// Sends all requests, one ahead, and returns us a point.
double batches_us(BenchClient& client, const std::vector<std::string>& requests) {
  const auto from = std::chrono::steady_clock::now();
  client.send(requests.front());
  for (std::size_t i = 0; i < requests.size(); ++i) {
    if (i + 1 < requests.size()) client.send(requests[i + 1]);
    client.receive();
  }
  return 1e3 * since_ms(from) / static_cast<double>(requests.size() * kServedBatch);
}

// Round trips of single points, us, of one of several clients.
std::vector<double> roundTrips_us(std::uint16_t port, const std::string& set, const std::vector<Vector3d>& points) {
  BenchClient client(port);
  std::vector<double> us;
  for (const Vector3d& p : points) {
    const std::string request = "GET /v1/sets/" + set + "/nearest?at=" + std::to_string(p.x()) + "," +
                                std::to_string(p.y()) + "," + std::to_string(p.z()) +
                                " HTTP/1.1\r\nHost: localhost\r\n\r\n";
    const auto from = std::chrono::steady_clock::now();
    client.send(request);
    client.receive();
    us.push_back(1e3 * since_ms(from));
  }
  return us;
}

BenchReport runServe(const BenchOptions& options) {
  const std::uint64_t segments = options.segments != 0 ? options.segments : options.quick ? 20'000 : 1'000'000;
  const std::size_t count = options.quick ? 2 : 40;  // requests of a batch
  const WorkFolder folder(options.out, "serve");
  options.progress("a set of " + std::to_string(segments) + " segments");
  const std::vector<Cell> library = morphologyLibrary(options.corpus, options.quick ? 4 : 60, options.seed);
  DenseCells cells(library, segments, kPerUm3, options.seed);
  const double side_um = cells.side_um();
  ingest(cells, folder.path() + "/dense.fil");
  const BenchServer server(folder.path() + "/dense.fil", std::uint64_t{2} << 30);

  std::vector<std::vector<Vector3d>> points;
  std::vector<std::string> requests;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(pointsInCube(side_um, kServedBatch, options.seed + i));
    requests.push_back(requestOf("dense", points.back()));
  }
  options.progress("batches of 1000 points");
  BenchClient client(server.port());
  batches_us(client, requests);  // reads the tiles
  std::vector<double> own, served, ratios;
  for (int batch = 0; batch < kBatches; ++batch) {
    const auto from = std::chrono::steady_clock::now();
    for (const auto& some : points) server.served().nearest().findAll(some);
    own.push_back(1e3 * since_ms(from) / static_cast<double>(count * kServedBatch));
    served.push_back(batches_us(client, requests));
    ratios.push_back(own.back() / served.back());
  }
  options.progress("single points");
  const std::size_t singles = options.quick ? 50 : 5000;
  std::vector<double> alone = roundTrips_us(server.port(), "dense", pointsInCube(side_um, singles, 77));
  std::vector<std::vector<double>> crowd(16);
  {
    std::vector<std::jthread> clients;
    for (std::size_t c = 0; c < crowd.size(); ++c)
      clients.emplace_back(
          [&, c] { crowd[c] = roundTrips_us(server.port(), "dense", pointsInCube(side_um, singles / 10, 100 + c)); });
  }
  std::vector<double> together;
  for (const auto& one : crowd) together.insert(together.end(), one.begin(), one.end());

  BenchReport report;
  report.tables.push_back(
      {"batches",
       "k = 1, batches of 1000 points as .npy, everything in memory: us a point (median)",
       {"by", "us"},
       {{"library, one thread", median(own)}, {"service, one thread that answers", median(served)}}});
  report.tables.push_back(
      {"single",
       "Round trip of one point as JSON, us",
       {"clients", "p50", "p99"},
       {{"1", median(alone), percentile(alone, 0.99)}, {"16", median(together), percentile(together, 0.99)}}});
  const double ratio = median(ratios), p50 = median(alone), p99 = percentile(together, 0.99);
  report.goals.push_back(
      {"throughput of the service over that of the library", ">= 0.7", ">= 0.9", ratio, ratio >= 0.7, ratio >= 0.9});
  report.goals.push_back({"round trip of a point, one client, p50, us", "<= 150", "<= 75", p50, p50 <= 150, p50 <= 75});
  report.goals.push_back(
      {"round trip of a point, 16 clients, p99, us", "<= 10000", "<= 2000", p99, p99 <= 10000, p99 <= 2000});
  return report;
}

}  // namespace

void addServeWorkloads(std::vector<Workload>& all) {
  all.push_back({"serve", "throughput and latency of the service, beside the library", runServe});
}

}  // namespace filiform::tools
