// bench bridge: an exchange with a device behind a bridge, beside a bare ping-pong of 96 bytes over the same kind of
// socket; and how long a bridge renders force after its program is killed or stopped.
#include "device/bridge/bridge_device.h"
#include "device/process/process_device.h"
#include "solver/loop/haptic_loop.h"
#include "tools/bridges/bridge.h"
#include "tools/lab/bench/bench_process.h"
#include "tools/lab/bench/device/opened_bridge.h"
#include "tools/lab/bench/workloads.h"

#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <netinet/in.h>
#include <optional>
#include <pthread.h>
#include <sched.h>
#include <stdexcept>
#include <string>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

namespace filiform::tools {

namespace {

constexpr std::size_t kPingBytes = 96;

// A device that costs nothing to read and write: only the bridge is measured.
int readNothing(void*, fb_state* state) {
  std::fill_n(state->p_D, 3, 0.0);
  return 1;
}
int writeNothing(void*, const double*) { return 1; }

void serveBridge(const std::string& address) {
  if (::freopen("/dev/null", "w", stdout) == nullptr) return;
  bridge_device device{};
  device.read = readNothing;
  device.write = writeNothing;
  device.hello.flags = FB_KNOWS_VELOCITY;
  for (int i = 0; i < 3; ++i) device.hello.lo_D[i] = -(device.hello.hi_D[i] = 0.05);
  device.hello.peak_force_N = 8;
  device.hello.rate_Hz = 1000;
  std::strcpy(device.hello.name, "bench");
  bridge_run(&device, address.c_str());
}

// Two ends of a connection; the second one is the peer's.
std::array<int, 2> connection(bool udp) {
  std::array<int, 2> ends{-1, -1};
  if (!udp) {
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
      throw std::runtime_error("bench bridge: no sockets");
    return ends;
  }
  std::array<sockaddr_in, 2> at{};
  for (std::size_t i = 0; i < 2; ++i) {
    at[i].sin_family = AF_INET;
    at[i].sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at[i];
    ends[i] = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (::bind(ends[i], reinterpret_cast<const sockaddr*>(&at[i]), size) != 0 ||
        ::getsockname(ends[i], reinterpret_cast<sockaddr*>(&at[i]), &size) != 0)
      throw std::runtime_error("bench bridge: no sockets");
  }
  for (std::size_t i = 0; i < 2; ++i)
    static_cast<void>(::connect(ends[i], reinterpret_cast<const sockaddr*>(&at[1 - i]), sizeof at[i]));
  return ends;
}

void pong(int end) {
  char bytes[kPingBytes];
  while (::recv(end, bytes, sizeof bytes, 0) > 0 && ::send(end, bytes, sizeof bytes, MSG_NOSIGNAL) > 0) {
  }
}

double elapsed_us(std::chrono::steady_clock::time_point from) { return 1e3 * since_ms(from); }

struct Transport {
  std::string name;
  std::vector<double> ping_us, exchange_us;
  std::uint64_t unanswered = 0;
};

// Alternates a ping and an exchange, each at the beginning of a millisecond.
Transport measureTransport(bool udp, const std::string& address, int rounds, const BenchOptions& options) {
  Transport t;
  t.name = udp ? "UDP" : "seqpacket";
  const std::array<int, 2> ends = connection(udp);
  const BenchProcess peer([&] { pong(ends[1]); });
  const BenchProcess bridge([&] { serveBridge(address); });
  const auto device = openedBridge({.address = address, .connect_s = 0.5});
  char bytes[kPingBytes] = {};
  auto due = std::chrono::steady_clock::now();
  for (int i = 0; i < rounds; ++i) {
    std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
    auto from = std::chrono::steady_clock::now();
    if (::send(ends[0], bytes, sizeof bytes, 0) <= 0 || ::recv(ends[0], bytes, sizeof bytes, 0) <= 0)
      throw std::runtime_error("bench bridge: the ping-pong ended");
    t.ping_us.push_back(elapsed_us(from));
    std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
    from = std::chrono::steady_clock::now();
    device->exchange({});
    t.exchange_us.push_back(elapsed_us(from));
    if (i % 500 == 0) options.progress(t.name + ", " + std::to_string(i) + " of " + std::to_string(rounds));
  }
  t.unanswered = device->counters().unanswered;
  ::close(ends[0]);
  ::close(ends[1]);
  return t;
}

// The hop that a device process adds: an exchange with a device that costs nothing, by a thread with the priority of
// the haptic thread if the system grants it.
struct Hop {
  bool realtime = false;
  std::vector<double> us;
};

Hop measureHop(int rounds) {
  ProcessDevice device({.device = "null"});
  device.open();
  Hop hop;
  std::thread([&] {
    sched_param priority{};
    priority.sched_priority = HapticLoopOptions{}.priority;
    hop.realtime = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &priority) == 0;
    auto due = std::chrono::steady_clock::now();
    for (int i = 0; i < rounds; ++i) {
      std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
      const auto from = std::chrono::steady_clock::now();
      device.exchange({});
      hop.us.push_back(elapsed_us(from));
    }
  }).join();
  return hop;
}

// The longest age (ms) of a command whose force was still rendered, after a signal to the program.
double lastForce_ms(int signal, const std::string& folder) {
  const std::string address = folder + "/b", log = folder + "/log";
  ::setenv("FILIFORM_BRIDGE_LOG", log.c_str(), 1);
  std::optional<BenchProcess> bridge(std::in_place, [&] { serveBridge(address); });
  ::unsetenv("FILIFORM_BRIDGE_LOG");
  {
    const BenchProcess program([&] {
      const auto device = openedBridge({.address = address, .connect_s = 0.5});
      Wrench wrench;
      wrench.force_N = {0, 0, 2};
      for (;; std::this_thread::sleep_for(std::chrono::milliseconds(1))) device->exchange(wrench);
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(800));  // the ramp takes 500
    program.signal(signal);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    bridge.reset();
  }
  double longest_ms = 0;
  std::ifstream rows(log);
  std::int64_t time_ns = 0, command_ns = 0;
  double mode = 0, force_N = 0, x_m = 0, y_m = 0, z_m = 0;
  while (rows >> time_ns >> command_ns >> mode >> force_N >> x_m >> y_m >> z_m)
    if (force_N > 0) longest_ms = std::max(longest_ms, 1e-6 * static_cast<double>(time_ns - command_ns));
  ::unlink(log.c_str());
  return longest_ms;
}

BenchReport runBridge(const BenchOptions& options) {
  const WorkFolder folder(options.out, "bridge");
  ::setenv("FILIFORM_BRIDGE_COOKIE", (folder.path() + "/cookie").c_str(), 1);
  const std::array<int, 2> probe = connection(true);
  sockaddr_in free{};
  socklen_t size = sizeof free;
  static_cast<void>(::getsockname(probe[0], reinterpret_cast<sockaddr*>(&free), &size));
  for (const int end : probe) ::close(end);
  const int rounds = options.quick ? 50 : options.long_run ? 60'000 : 5'000;
  BenchReport report;
  BenchTable times{"times",
                   "Round trips once in 2 ms, us; a ping and an exchange by turns",
                   {"transport", "what", "p50", "p99", "p99.9", "most", "unanswered"},
                   {},
                   {"transport", "what"}};
  for (const bool udp : {false, true}) {
    const std::string address =
        udp ? "udp:127.0.0.1:" + std::to_string(ntohs(free.sin_port)) : folder.path() + "/socket";
    const Transport t = measureTransport(udp, address, rounds, options);
    for (const bool exchange : {false, true}) {
      const std::vector<double>& us = exchange ? t.exchange_us : t.ping_us;
      times.rows.push_back({t.name, std::string(exchange ? "exchange" : "ping-pong of 96 bytes"), percentile(us, 0.5),
                            percentile(us, 0.99), percentile(us, 0.999), percentile(us, 1),
                            static_cast<std::int64_t>(exchange ? t.unanswered : 0)});
      report.samples.push_back({"times",
                                {t.name, std::string(exchange ? "exchange" : "ping-pong of 96 bytes")},
                                "p50",
                                "us",
                                false,
                                batchMedians(us)});
    }
    if (udp) continue;
    const double p50 = percentile(t.exchange_us, 0.5) / percentile(t.ping_us, 0.5);
    const double p99 = percentile(t.exchange_us, 0.99) / percentile(t.ping_us, 0.99);
    report.goals.push_back(
        {"exchange over seqpacket, p50, against a ping-pong", "<= 1.5 times", "", p50, p50 <= 1.5, p50 <= 1.5});
    report.goals.push_back(
        {"exchange over seqpacket, p99, against a ping-pong", "<= 2 times", "", p99, p99 <= 2, p99 <= 2});
  }
  const Hop hop = measureHop(rounds);
  const double hop50_us = percentile(hop.us, 0.5), hop99_us = percentile(hop.us, 0.99);
  times.rows.push_back({std::string("device process"),
                        std::string(hop.realtime ? "exchange" : "exchange without real-time priority"), hop50_us,
                        hop99_us, percentile(hop.us, 0.999), percentile(hop.us, 1), std::int64_t{0}});
  report.goals.push_back({"hop of a device process, p50, us", "<= 60", "", hop50_us, hop50_us <= 60, hop50_us <= 60});
  report.goals.push_back(
      {"hop of a device process, p99, us", "<= 300", "", hop99_us, hop99_us <= 300, hop99_us <= 300});
  report.tables.push_back(std::move(times));
  ::unsetenv("FILIFORM_BRIDGE_COOKIE");

  BenchTable last{"last force",
                  "The last force that the bridge rendered, ms after the last command",
                  {"program", "runs", "median", "most"},
                  {},
                  {"program"}};
  const int runs = options.quick ? 1 : 10;
  for (const int signal : {SIGKILL, SIGSTOP}) {
    std::vector<double> all_ms;
    for (int i = 0; i < runs; ++i) {
      options.progress("last force, run " + std::to_string(i + 1));
      all_ms.push_back(lastForce_ms(signal, folder.path()));
    }
    const std::string name = signal == SIGKILL ? "killed" : "stopped";
    const double most = percentile(all_ms, 1);
    last.rows.push_back({name, std::int64_t{runs}, median(all_ms), most});
    report.goals.push_back(
        {"last force after the program is " + name + ", ms", "< 70", "", most, most < 70, most < 70});
  }
  report.tables.push_back(std::move(last));
  report.notes.push_back(
      "The bridge runs in a process of its own, with a device that costs nothing, and steps once a millisecond.");
  return report;
}

}  // namespace

void addBridgeWorkloads(std::vector<Workload>& all) {
  all.push_back(
      {"bridge", "an exchange through a bridge beside a bare ping-pong; force after the program is killed", runBridge});
}

}  // namespace filiform::tools
