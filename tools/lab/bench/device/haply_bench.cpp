// bench haply: how fast the driver of the Haply service exchanges with a simulated service by TCP, compared with a bare
// exchange of as many bytes between two threads; and the energy that its transport gives beyond the bound.
#include "device/haply/haply_device.h"
#include "device/haply/simulated_haply.h"
#include "device/haply/simulated_haply_server.h"
#include "tools/lab/bench/workloads.h"
#include "tools/lab/reference/haply_sweep.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

namespace filiform::tools {

namespace {

using Clock = std::chrono::steady_clock;

double passed_us(Clock::time_point begin) {
  return std::chrono::duration<double, std::micro>(Clock::now() - begin).count();
}

// A thread that answers `request` bytes with `answer` bytes, until its socket ends.
class BarePeer {
 public:
  static constexpr std::size_t kRequest = 150, kAnswer = 700;  // as a command and a state

  BarePeer() {
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends_.data()) != 0)
      throw std::runtime_error("no pair of sockets");
    thread_ = std::thread([peer = ends_[1]] {
      std::array<char, kAnswer> bytes{};
      while (::recv(peer, bytes.data(), kRequest, MSG_WAITALL) == static_cast<ssize_t>(kRequest))
        if (::send(peer, bytes.data(), kAnswer, MSG_NOSIGNAL) < 0) break;
    });
  }
  ~BarePeer() {
    ::shutdown(ends_[0], SHUT_RDWR);
    thread_.join();
    ::close(ends_[0]);
    ::close(ends_[1]);
  }
  BarePeer(const BarePeer&) = delete;
  BarePeer& operator=(const BarePeer&) = delete;

  void exchange() {
    if (::send(ends_[0], bytes_.data(), kRequest, MSG_NOSIGNAL) != static_cast<ssize_t>(kRequest) ||
        ::recv(ends_[0], bytes_.data(), kAnswer, MSG_WAITALL) != static_cast<ssize_t>(kAnswer))
      throw std::runtime_error("the bare exchange has ended");
  }

 private:
  std::array<int, 2> ends_{};
  std::thread thread_;
  std::array<char, kAnswer> bytes_{};
};

void addExchanges(const BenchOptions& options, BenchReport& report) {
  const int exchanges = options.quick ? 500 : options.long_run ? 1'000'000 : 50'000;
  SimulatedHaply service;
  const SimulatedHaplyServer server(service);
  HaplyOptions device;
  device.port = server.port();
  device.most_rate_Hz = 1e6;  // as fast as the service answers
  HaplyDevice haply(device);
  haply.open();
  for (int i = 0; i < 10'000 && haply.status() != DeviceStatus::ready; ++i) haply.exchange({});
  if (haply.status() != DeviceStatus::ready) throw std::runtime_error(std::string("not ready: ") + haply.advice());
  BarePeer bare;
  std::vector<double> haply_us, bare_us;
  const std::uint64_t unanswered = haply.counters().unanswered;
  Wrench wrench;
  // In turns, so that both meet the same machine.
  for (int done = 0; done < exchanges;) {
    options.progress("exchange " + std::to_string(done));
    for (int i = 0; i < 500; ++i, ++done) {
      wrench.force_N.x() = std::sin(0.01 * done);
      const auto begin = Clock::now();
      haply.exchange(wrench);
      haply_us.push_back(passed_us(begin));
    }
    for (int i = 0; i < 500; ++i) {
      const auto begin = Clock::now();
      bare.exchange();
      bare_us.push_back(passed_us(begin));
    }
  }
  haply.close();
  BenchTable table{"exchanges",
                   "Lock-step exchanges with a simulated service by TCP, and bare ones of as many bytes, us",
                   {"exchange", "p50", "p90", "p99", "p99.9", "most"},
                   {}};
  for (const auto& [name, times] : {std::pair("haply", &haply_us), std::pair("bare", &bare_us)})
    table.rows.push_back({std::string(name), percentile(*times, 0.5), percentile(*times, 0.9), percentile(*times, 0.99),
                          percentile(*times, 0.999), percentile(*times, 1)});
  report.tables.push_back(std::move(table));
  report.samples.push_back({.table = "exchanges",
                            .row = {std::string("haply")},
                            .column = "p50",
                            .unit = "us",
                            .batches = batchMedians(haply_us)});
  const double rate_Hz = 1e6 / percentile(haply_us, 0.5);
  report.goals.push_back({"lock-step rate against the simulated service, p50, Hz", ">= 2000", "", rate_Hz,
                          rate_Hz >= 2000, rate_Hz >= 2000});
  report.notes.push_back(std::to_string(haply.counters().unanswered - unanswered) + " of " + std::to_string(exchanges) +
                         " exchanges had no answer within 5 ms");
}

void addSweep(const BenchOptions& options, BenchReport& report) {
  options.progress("energy");
  const HaplySweep sweep = haplySweep(options.quick ? 0.5 : options.long_run ? 20 : 4);
  BenchTable table{"energy",
                   "Energy that a hand received through the driver, and beyond the bound of solver/FORCES.md, J",
                   {"stiffness_N_m", "delay", "period_ms", "given", "beyond"},
                   {},
                   {"stiffness_N_m", "delay", "period_ms"}};
  for (const HaplySweep::Cell& cell : sweep.cells)
    table.rows.push_back(
        {cell.stiffness_N_m, static_cast<std::int64_t>(cell.delay), 1e3 * cell.period_s, cell.given_J, cell.beyond_J});
  report.tables.push_back(std::move(table));
  report.bounds.push_back(
      {"energy through the Haply driver", "passivity, solver/FORCES.md, bound 8", 1e-9, sweep.beyond_J, "J"});
}

BenchReport runHaply(const BenchOptions& options) {
  BenchReport report;
  addExchanges(options, report);
  addSweep(options, report);
  return report;
}

}  // namespace

void addHaplyWorkloads(std::vector<Workload>& all) {
  all.push_back(
      {"haply", "the driver of the Haply service: rate by TCP, and energy over stiffness and delay", runHaply});
}

}  // namespace filiform::tools
