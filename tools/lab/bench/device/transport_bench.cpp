// bench transports: the energy that a hand receives through the transports' real sockets, over stiffness and delay.
// --long adds an hour of it.
#include "tools/lab/bench/device/transport_sweep.h"
#include "tools/lab/bench/workloads.h"
#include "tools/program/interruption.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace filiform::tools {

namespace {

constexpr double kSoak_s = 1200;  // of each of the three transports

void addCell(BenchTable& table, const SweepCell& cell) {
  table.rows.push_back({std::string(toString(cell.transport)), cell.stiffness_N_m, 1e3 * cell.period_s,
                        static_cast<std::int64_t>(cell.exchanges), static_cast<std::int64_t>(cell.unanswered),
                        static_cast<std::int64_t>(cell.losses), 1e3 * cell.longest_gap_s, cell.ramped_s,
                        cell.strongest_N, cell.given_J, cell.beyond_J});
}

BenchTable cellTable(const std::string& name, const std::string& title) {
  return {name,
          title,
          {"transport", "stiffness_N_m", "period_ms", "exchanges", "unanswered", "losses", "longest_gap_ms", "ramped_s",
           "strongest_N", "given_J", "beyond_J"},
          {},
          {"transport", "stiffness_N_m", "period_ms"}};
}

BenchReport runTransports(const BenchOptions& options) {
  const WorkFolder folder(options.out, "transports");
  const double seconds = options.quick ? 0.2 : 4;
  BenchReport report;
  BenchTable sweep = cellTable("sweep",
                               "Energy that a hand received through real sockets, and beyond the bound of "
                               "solver/FORCES.md, J");
  double beyond_J = 0;
  const auto run = [&](SweepCell cell, double for_s, BenchTable& table) {
    options.progress(std::string(toString(cell.transport)) + ", " + std::to_string(std::lround(cell.stiffness_N_m)) +
                     " N/m, " + std::to_string(std::lround(1e3 * cell.period_s)) + " ms");
    runSweepCell(cell, for_s, folder.path(), [] { return interruptFlag().load(); });
    throwIfInterrupted();
    beyond_J = std::max(beyond_J, cell.beyond_J);
    addCell(table, cell);
  };
  constexpr SweepTransport kAll[] = {SweepTransport::seqpacket, SweepTransport::udp, SweepTransport::haply,
                                     SweepTransport::process};
  for (const SweepTransport transport : kAll)
    for (const double stiffness_N_m : {50.0, 200.0, 800.0, 3200.0})
      for (const double period_s : {0.001, 0.002, 0.004}) {
        if (options.quick && (stiffness_N_m != 800 || period_s != 0.001)) continue;
        run({.transport = transport, .stiffness_N_m = stiffness_N_m, .period_s = period_s}, seconds, sweep);
      }
  report.tables.push_back(std::move(sweep));
  BenchTable stalled = cellTable("stalls", "The same, with stalls of 12 to 45 ms, 976 in ten minutes");
  const double stalled_s = options.quick ? 1 : options.long_run ? 600 : 20;
  for (const SweepTransport transport : kAll)
    for (const double stiffness_N_m : {200.0, 800.0})
      run({.transport = transport, .stiffness_N_m = stiffness_N_m, .stalls = true}, stalled_s, stalled);
  report.tables.push_back(std::move(stalled));
  if (options.long_run) {
    BenchTable soak = cellTable("soak", "The same for an hour");
    for (const SweepTransport transport : kAll)
      run({.transport = transport, .stiffness_N_m = 800, .period_s = 0.001}, kSoak_s, soak);
    report.tables.push_back(std::move(soak));
  }
  report.bounds.push_back(
      {"energy through the transports", "passivity, solver/FORCES.md, bound 8", 1e-9, beyond_J, "J"});
  report.notes.push_back(
      "A force is late by the period and the transport. The hand has 0.15 kg, 0.5 N s/m and 60 N/m, so it can vibrate. "
      "A window may receive the spring's energy at its begin, 1 mJ, 0.1 mW, and (delay + 1) times the strongest "
      "force on the hand's longest way between two states.");
  return report;
}

}  // namespace

void addTransportWorkloads(std::vector<Workload>& all) {
  all.push_back({"transports", "energy through the sockets of bridges and of the Haply service; --long: for an hour",
                 runTransports});
}

}  // namespace filiform::tools
