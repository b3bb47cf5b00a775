// `filiform bench transports` runs more of this, and --long an hour.
#include "tools/lab/bench/device/transport_sweep.h"

#include "tests/support/temp_folder.h"
#include "tools/lab/bench/device/energy_meter.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using Eigen::Vector3d;

// On a busy machine, a late exchange takes the force back until it may grow again: then nothing is felt in half a
// second.
constexpr int kMostRuns = 8;

TEST(TransportSweep, RealSocketsGiveNoMoreEnergyThanTheBound) {
  const test::TempFolder folder;
  for (const SweepTransport transport :
       {SweepTransport::seqpacket, SweepTransport::udp, SweepTransport::haply, SweepTransport::process})
    for (const double stiffness_N_m : {200.0, 3200.0}) {
      SweepCell cell;
      for (int run = 0; run < kMostRuns && cell.strongest_N <= 0.1; ++run) {
        cell = {.transport = transport, .stiffness_N_m = stiffness_N_m};
        runSweepCell(cell, 0.5, folder.path());
        EXPECT_LE(cell.beyond_J, 1e-9) << toString(transport) << ", " << stiffness_N_m << " N/m";
      }
      EXPECT_GT(cell.strongest_N, 0.1) << toString(transport);
      EXPECT_GT(cell.exchanges, 50U) << toString(transport);
    }
}

TEST(TransportSweep, StallsGiveNoEnergyBeyondTheBound) {
  const test::TempFolder folder;
  for (const SweepTransport transport : {SweepTransport::seqpacket, SweepTransport::haply, SweepTransport::process}) {
    SweepCell cell{.transport = transport, .stiffness_N_m = 800, .stalls = true};
    runSweepCell(cell, 4, folder.path());
    EXPECT_LE(cell.beyond_J, 1e-9) << toString(transport);
    EXPECT_GT(cell.longest_gap_s, 0.012) << toString(transport);
  }
}

// The device processes that this process started.
std::vector<int> deviceProcesses() {
  std::vector<int> found;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream children(task.path() / "children");
    for (int id = 0; children >> id;) {
      std::string name;
      std::ifstream("/proc/" + std::to_string(id) + "/comm") >> name;
      if (std::string("filiform-device").starts_with(name) && !name.empty()) found.push_back(id);
    }
  }
  return found;
}

TEST(TransportSweep, OpensADeviceThatIsLostAgain) {
  const test::TempFolder folder;
  SweepCell cell{.transport = SweepTransport::process, .stiffness_N_m = 800};
  int calls = 0;
  runSweepCell(cell, 2, folder.path(), [&calls] {
    if (++calls == 300)
      for (const int id : deviceProcesses()) ::kill(id, SIGKILL);
    return false;
  });
  EXPECT_GE(cell.losses, 1U);
  EXPECT_GT(cell.exchanges, 400U);
  EXPECT_LE(cell.beyond_J, 1e-9);
}

TEST(EnergyMeter, CountsWhatIsBeyondTheSpring) {
  EnergyMeter meter(200, 8, 0);
  const double begin_s = EnergyMeter::kBegin_s;
  meter.step(begin_s - 0.1, {100, 0, 0}, {1, 0, 0}, {1, 0, 0});
  EXPECT_EQ(meter.steps(), 0U) << "the ramps are not measured";
  // Out against the spring and back with it: nothing beyond.
  Vector3d p_D = Vector3d::Zero();
  double time_s = begin_s;
  const auto go = [&](double to_m, double part) {
    const double step_m = to_m > p_D.x() ? 1e-5 : -1e-5;
    while (std::abs(p_D.x() - to_m) > 1e-9) {
      const Vector3d force_N(-200 * part * (p_D.x() + step_m / 2), 0, 0), dx_D(step_m, 0, 0);
      p_D += dx_D;
      meter.step(time_s += 1e-4, force_N, dx_D, p_D);
    }
  };
  go(0.01, 1);
  go(0, 1);
  EXPECT_NEAR(meter.excess_J(), 0, 1e-12);
  EXPECT_NEAR(meter.given_most_J(), 0.01, 1e-9) << "half of K x^2, on the way back";
  EXPECT_NEAR(meter.strongest_N(), 2, 2e-3);
  EXPECT_NEAR(meter.longestWay_m(0.008), 0.0009, 2e-5) << "0.1 m/s, in 8 ms and one more";
  // The force is half as strong on the way out.
  go(0.01, 0.5);
  go(0, 1);
  EXPECT_NEAR(meter.excess_J(), 0.005, 1e-6);
}

}  // namespace
}  // namespace filiform::tools
