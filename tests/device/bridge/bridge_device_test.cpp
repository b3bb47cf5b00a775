#include "device/bridge/bridge_device.h"

#include "device/bridge/bridge_folder.h"
#include "device/factory/device_factory.h"
#include "tests/support/devices/bridge_process.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/servers/free_port.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <fcntl.h>
#include <fstream>
#include <functional>
#include <optional>
#include <sstream>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using namespace std::chrono_literals;
using Eigen::Vector3d;
using test::BridgeProcess;
using test::refusalOf;

// Long enough for a loaded machine: only a failure waits so long.
constexpr auto kPatience = 60s;

bool eventually(const std::function<bool()>& holds) {
  for (const auto end = std::chrono::steady_clock::now() + kPatience; std::chrono::steady_clock::now() < end;) {
    if (holds()) return true;
    std::this_thread::sleep_for(1ms);
  }
  return holds();
}

// Stalls of a loaded machine do not end in a fault.
BridgeOptions patient(const std::string& address) { return {.address = address, .silence_s = 60, .connect_s = 60}; }

// A spring to the centre of the workspace, with the hand at p_D.
Wrench springToCentre(double stiffness_N_m, const Vector3d& p_D) {
  Wrench wrench;
  wrench.force_N = -stiffness_N_m * p_D;
  wrench.model.at_D = p_D;
  wrench.model.stiffness_N_m = stiffness_N_m * Eigen::Matrix3d::Identity();
  wrench.model.radius_m = 0.05;
  return wrench;
}

struct LoggedForce {
  std::int64_t time_ns = 0, command_ns = 0;
  int mode = 0;
  double force_N = 0;
  Vector3d p_D = Vector3d::Zero();
};

std::vector<LoggedForce> readLog(const std::string& path) {
  std::vector<LoggedForce> rows;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line) && !file.eof();) {  // the last line may still be without its end
    LoggedForce row;
    std::istringstream words(line);
    if (words >> row.time_ns >> row.command_ns >> row.mode >> row.force_N >> row.p_D.x() >> row.p_D.y() >> row.p_D.z())
      rows.push_back(row);
  }
  return rows;
}

// A process that pushes with 2 N through the bridge, once a millisecond, until a signal ends it.
class PushingProcess {
 public:
  explicit PushingProcess(const std::string& address) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("cannot make a pipe");
    process_ = ::fork();
    if (process_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      push(address, ends[1]);
      ::_exit(1);
    }
    ::close(ends[1]);
    char c = 0;
    pushes_ = ::read(ends[0], &c, 1) == 1;
    ::close(ends[0]);
  }
  ~PushingProcess() {
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
  PushingProcess(const PushingProcess&) = delete;
  PushingProcess& operator=(const PushingProcess&) = delete;

  bool pushes() const { return pushes_; }
  void signal(int signal) const { ::kill(process_, signal); }

 private:
  static void push(const std::string& address, int told) {
    try {
      BridgeDevice device(patient(address));
      device.open();
      Wrench wrench;
      wrench.force_N = {0, 0, 2};
      for (;;) {
        const DeviceState state = device.exchange(wrench);
        if (state.sent_N && state.sent_N->z() > 1.99 && told >= 0) {
          if (::write(told, "p", 1) != 1) return;
          ::close(told);
          told = -1;
        }
        if (state.status == DeviceStatus::fault) return;
        std::this_thread::sleep_for(1ms);
      }
    } catch (const std::exception&) {
    }
  }
  pid_t process_ = -1;
  bool pushes_ = false;
};

TEST(BridgeDevice, KnowsTheDeviceBeforeItIsOpen) {
  const test::TempFolder folder;
  BridgeProcess bridge(folder / "b");
  EXPECT_EQ(bridge.line(), "simulated: use filiform's --device bridge:" + (folder / "b"));
  const auto device = makeDevice("bridge:" + (folder / "b"));
  const DeviceCapabilities& can = device->capabilities();
  EXPECT_EQ(device->status(), DeviceStatus::closed);
  EXPECT_EQ(can.name, "simulated (bridge)");
  EXPECT_EQ(can.peak_force_N, 8);
  EXPECT_EQ(can.max_stiffness_N_m, 2000);
  EXPECT_EQ(can.damping_Ns_m, 0.5);
  EXPECT_EQ(can.workspace_hi_D, Vector3d(0.06, 0.06, 0.06));
  EXPECT_TRUE(can.keeps_time);
  EXPECT_TRUE(can.is_led);
  EXPECT_FALSE(can.paces_loop);
  EXPECT_GE(can.delay_samples, 1);
  const auto& bridged = dynamic_cast<BridgeDevice&>(*device);
  EXPECT_GT(bridged.typicalRoundTrip_s(), 0);
  EXPECT_GE(bridged.longestRoundTrip_s(), bridged.typicalRoundTrip_s());
  bridge.signal(SIGTERM);
  EXPECT_EQ(bridge.wait(), 0);
  EXPECT_NE(::access((folder / "b").c_str(), F_OK), 0) << "the bridge removes its socket";
}

TEST(BridgeDevice, ForceMovesTheHandAtTheOtherEnd) {
  const test::TempFolder folder;
  BridgeProcess bridge(folder / "b");
  BridgeDevice device(patient(folder / "b"));
  Wrench wrench;
  wrench.force_N = {0, 2, 0};
  EXPECT_EQ(device.exchange(wrench).status, DeviceStatus::closed);
  device.open();
  ASSERT_TRUE(eventually([&] { return device.exchange(wrench).p_D.y() > 0.0095; })) << "2 N on a spring of 200 N/m";
  const DeviceState state = device.exchange(wrench);
  EXPECT_EQ(state.status, DeviceStatus::ready);
  EXPECT_GT(state.time_s, 0);
  device.lead({0.02, 0, 0});
  EXPECT_TRUE(eventually([&] { return device.exchange({}).p_D.x() > 0.019; })) << "a led hand follows";
  wrench.force_N = {0, std::nan(""), 0};
  const DeviceState after_nan = device.exchange(wrench);
  ASSERT_TRUE(after_nan.sent_N);
  EXPECT_EQ(*after_nan.sent_N, Vector3d::Zero());
  wrench.force_N = {0, 1e300, 0};
  EXPECT_LE(device.exchange(wrench).sent_N->norm(), 8);
  device.close();
  EXPECT_EQ(device.status(), DeviceStatus::closed);
  device.open();
  EXPECT_TRUE(eventually([&] { return device.exchange({}).status == DeviceStatus::ready; })) << "it opens again";
  EXPECT_EQ(device.counters().strange, 0U);
  EXPECT_EQ(device.counters().refused, 0U);
}

TEST(BridgeDevice, TheModelIsRenderedBetweenCommands) {
  const test::TempFolder folder;
  BridgeProcess bridge(folder / "b");
  BridgeDevice device(patient(folder / "b"));
  device.open();
  // A spring to the origin, against an aim at 7 mm: 200 (7 mm - x) = 500 x.
  device.lead({0.007, 0, 0});
  DeviceState state;
  EXPECT_TRUE(eventually([&] {
    state = device.exchange(springToCentre(500, state.p_D));
    return std::abs(state.p_D.x() - 0.002) < 1e-5 && state.v_D.norm() < 1e-4 && state.sent_N->norm() > 0.9;
  })) << state.p_D.x();
}

// Steps of an armed bridge after its ramp, at least 2 ms after their command.
std::vector<LoggedForce> betweenCommands(const std::string& log) {
  std::vector<LoggedForce> between;
  std::int64_t ramp_ns = 0, command_ns = 0;
  for (const LoggedForce& row : readLog(log)) {
    // A command that came late, on a busy machine, ends a fade, maybe within one step.
    if (row.mode != 1 || row.command_ns - command_ns > 20'000'000) ramp_ns = row.time_ns + 600'000'000;
    command_ns = row.command_ns;
    if (row.time_ns > ramp_ns && row.time_ns - row.command_ns > 2'000'000) between.push_back(row);
  }
  return between;
}

// Commands come every 5 ms, the bridge steps twice a millisecond: the force of all its steps is that of the spring. The
// log is read only after the commands: while it was read, none would come, and the ramp would begin again.
TEST(BridgeDevice, TheForceBetweenCommandsFollowsTheModel) {
  constexpr double kStiffness_N_m = 300;
  for (const bool models : {true, false}) {
    const test::TempFolder folder;
    BridgeProcess bridge(folder / "b", folder / "log");
    BridgeDevice device(patient(folder / "b"));
    device.open();
    DeviceState state = device.exchange({});
    std::chrono::milliseconds commands_take = 1s;
    ASSERT_TRUE(eventually([&] {
      const auto begin = std::chrono::steady_clock::now();
      for (int i = 0; std::chrono::steady_clock::now() < begin + commands_take; ++i) {
        device.lead({0.01 * std::sin(0.3 * i), 0.01 * std::cos(0.3 * i), 0});
        Wrench wrench = springToCentre(kStiffness_N_m, state.p_D);
        if (!models) wrench.model = {};
        state = device.exchange(wrench);
        std::this_thread::sleep_for(5ms);
      }
      commands_take *= 2;
      return betweenCommands(folder / "log").size() > 400;
    }));
    double worst_N = 0, strongest_N = 0;
    for (const LoggedForce& row : betweenCommands(folder / "log")) {
      strongest_N = std::max(strongest_N, row.force_N);
      worst_N = std::max(worst_N, std::abs(row.force_N - kStiffness_N_m * row.p_D.norm()));
    }
    EXPECT_GT(strongest_N, 0.5);
    if (models)
      EXPECT_LT(worst_N, 1e-6) << "of " << strongest_N << " N";
    else
      EXPECT_GT(worst_N, 0.05) << "without a model the force stands still";
  }
}

TEST(BridgeDevice, LeavesOutAModelThatIsNoSpring) {
  const test::TempFolder folder;
  BridgeProcess bridge(folder / "b");
  BridgeDevice device(patient(folder / "b"));
  EXPECT_TRUE(device.capabilities().renders_model);
  device.open();
  Wrench wrench;
  wrench.force_N = {0, 1, 0};
  ASSERT_TRUE(eventually([&] { return device.exchange(wrench).sent_N->y() > 1 - 1e-12; }));
  const std::function<void(LocalModel&)> wrongs[] = {
      [](LocalModel& m) { m.stiffness_N_m.setConstant(NAN); },
      [](LocalModel& m) { m.stiffness_N_m = -Eigen::Matrix3d::Identity(); },
      [](LocalModel& m) { m.stiffness_N_m(0, 1) = 50; },
      [](LocalModel& m) { m.stiffness_N_m(0, 1) = m.stiffness_N_m(1, 0) = 500; },
      [](LocalModel& m) { m.damping_Ns_m = -1; },
      [](LocalModel& m) { m.radius_m = INFINITY; },
      [](LocalModel& m) { m.at_D.setConstant(NAN); },
      [](LocalModel& m) { m.time_to_live_s = 0; },
  };
  for (const auto& spoil : wrongs) {
    wrench.model = springToCentre(100, {0, 0, 0}).model;
    EXPECT_TRUE(isSpring(wrench.model));
    spoil(wrench.model);
    EXPECT_FALSE(isSpring(wrench.model));
    EXPECT_NEAR(device.exchange(wrench).sent_N->y(), 1, 1e-9) << "the force goes out without the model";
  }
  EXPECT_EQ(device.counters().refused, 0U);
}

TEST(BridgeDevice, ExchangesWithoutAllocationOrLock) {
  const test::TempFolder folder;
  BridgeProcess bridge(folder / "b");
  BridgeDevice device(patient(folder / "b"));
  device.open();
  for (int i = 0; i < 10; ++i) device.exchange({});
  test::NoAllocGuard guard;
  for (int i = 0; i < 100; ++i) {
    device.lead({0.001, 0, 0});
    device.exchange({});
  }
  device.relax();
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.allocations + calls.locks, 0U) << calls.first;
}

TEST(BridgeDevice, ServesOneMasterAtATime) {
  const test::TempFolder folder;
  BridgeProcess bridge(folder / "b");
  std::optional<BridgeDevice> first(std::in_place, patient(folder / "b"));
  first->open();
  EXPECT_NE(refusalOf({.address = folder / "b"}).find("serves another program"), std::string::npos)
      << refusalOf({.address = folder / "b"});
  EXPECT_TRUE(eventually([&] { return first->exchange({}).status == DeviceStatus::ready; })) << "the first goes on";
  first.reset();
  EXPECT_TRUE(eventually([&] { return refusalOf({.address = folder / "b"}).empty(); }));
}

TEST(BridgeDevice, OnlyItsUserMayUseTheSocket) {
  const test::TempFolder folder;
  BridgeProcess bridge(folder / "b");
  struct stat found {};
  ASSERT_EQ(::stat((folder / "b").c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600U);
  EXPECT_THROW(BridgeProcess(folder / "b"), std::runtime_error) << "a second bridge at the path";
  if (::geteuid() != 0) GTEST_SKIP() << "only root can become another user, to try the rest";
  ASSERT_EQ(::chmod(folder.path().c_str(), 0755), 0);
  ASSERT_EQ(::chmod((folder / "b").c_str(), 0666), 0);
  const pid_t other = ::fork();
  if (other == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::seteuid(65534) != 0) ::_exit(2);
    const std::string refusal = refusalOf({.address = folder / "b"});
    ::_exit(refusal.find("another user") != std::string::npos ? 0 : 1);
  }
  int status = 0;
  ::waitpid(other, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0) << "a bridge of another user is not used";
}

// Every row of the log: 70 ms after the last command there is no force, whatever happened to the program.
void expectNoOldForce(const std::vector<LoggedForce>& rows, const char* what) {
  std::int64_t longest_ns = 0;
  for (const LoggedForce& row : rows) {
    const std::int64_t age_ns = row.time_ns - row.command_ns;
    if (row.force_N > 0) longest_ns = std::max(longest_ns, age_ns);
    ASSERT_TRUE(age_ns < 70'000'000 || row.force_N == 0)
        << what << ": " << row.force_N << " N after " << age_ns << " ns";
  }
  std::printf("%s: the last force was rendered %.1f ms after the last command\n", what,
              1e-6 * static_cast<double>(longest_ns));
}

TEST(BridgeDevice, ForceFadesAfterTheProgramIsKilled) {
  const test::TempFolder folder;
  BridgeProcess bridge(folder / "b", folder / "log");
  PushingProcess program(folder / "b");
  ASSERT_TRUE(program.pushes());
  program.signal(SIGKILL);
  ASSERT_TRUE(eventually([&] { return readLog(folder / "log").back().mode == 0; }));
  EXPECT_TRUE(eventually([&] { return refusalOf({.address = folder / "b"}).empty(); })) << "the next master is served";
  bridge.signal(SIGTERM);
  EXPECT_EQ(bridge.wait(), 0);
  expectNoOldForce(readLog(folder / "log"), "killed");
}

TEST(BridgeDevice, ForceFadesAfterTheProgramIsStopped) {
  const test::TempFolder folder;
  BridgeProcess bridge(folder / "b", folder / "log");
  PushingProcess program(folder / "b");
  ASSERT_TRUE(program.pushes());
  program.signal(SIGSTOP);
  ASSERT_TRUE(eventually([&] { return readLog(folder / "log").back().mode == 0; }));
  const std::size_t stopped = readLog(folder / "log").size();
  program.signal(SIGCONT);
  ASSERT_TRUE(eventually([&] { return readLog(folder / "log").back().force_N > 0.5; })) << "it arms the bridge again";
  bridge.signal(SIGTERM);
  EXPECT_EQ(bridge.wait(), 0);
  const std::vector<LoggedForce> rows = readLog(folder / "log");
  expectNoOldForce(rows, "stopped");
  std::int64_t zero_ns = 0;
  for (std::size_t i = stopped; i < rows.size(); ++i) {
    if (rows[i].mode == 0) zero_ns = rows[i].time_ns;
    const double since_s = 1e-9 * static_cast<double>(rows[i].time_ns - zero_ns);
    ASSERT_LE(rows[i].force_N, 2 * since_s / 0.5 + 1e-6) << "it grows with the ramp";
  }
}

TEST(BridgeDevice, TheStatusIsFaultAfterTheBridgeIsStoppedOrKilled) {
  const test::TempFolder folder;
  for (const int signal : {SIGSTOP, SIGKILL}) {
    BridgeProcess bridge(folder / "b");
    BridgeDevice device({.address = folder / "b", .silence_s = 1});
    device.open();
    ASSERT_TRUE(eventually([&] { return device.exchange({}).status == DeviceStatus::ready; }));
    bridge.signal(signal);
    ASSERT_TRUE(eventually([&] { return device.exchange({}).status == DeviceStatus::fault; }));
    const DeviceState last = device.exchange({});
    EXPECT_EQ(*last.sent_N, Vector3d::Zero());
    EXPECT_TRUE(last.p_D.allFinite());
    bridge.signal(SIGKILL);
    bridge.wait();
    EXPECT_THROW(device.open(), DeviceError);
    // The socket stays behind. The next bridge takes its place, and the device finds it.
    BridgeProcess next(folder / "b");
    device.open();
    EXPECT_TRUE(eventually([&] { return device.exchange({}).status == DeviceStatus::ready; }));
  }
}

TEST(BridgeDevice, WorksOverDatagramsWithTheCookie) {
  const test::TempFolder folder;
  const test::Variable cookie("FILIFORM_BRIDGE_COOKIE", folder / "cookie");
  const std::string address = "udp:127.0.0.1:" + std::to_string(test::freePort(SOCK_DGRAM));
  BridgeProcess bridge(address);
  struct stat found {};
  ASSERT_EQ(::stat((folder / "cookie").c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600U);
  {
    BridgeDevice device(patient(address));
    device.open();
    Wrench wrench;
    wrench.force_N = {0, 2, 0};
    EXPECT_TRUE(eventually([&] { return device.exchange(wrench).p_D.y() > 0.0095; }));
    EXPECT_NE(refusalOf({.address = address}).find("serves another program"), std::string::npos);
  }
  EXPECT_TRUE(eventually([&] { return refusalOf({.address = address}).empty(); }));
  test::writeBytes(folder / "wrong", std::string(32, '0'));
  ::chmod((folder / "wrong").c_str(), 0600);
  EXPECT_NE(refusalOf({.address = address, .cookie_file = folder / "wrong", .connect_s = 0.3}).find("does not answer"),
            std::string::npos);
  ::chmod((folder / "wrong").c_str(), 0644);
  EXPECT_NE(refusalOf({.address = address, .cookie_file = folder / "wrong"}).find("chmod 600"), std::string::npos);
  for (const char* const wrong : {"udp:", "udp:1", "udp:127.0.0.1", "udp:127.0.0.1:0", "udp:10.0.0.1:9",
                                  "udp:127.0.0.1:x", "udp:127.0.0.1:70000"})
    EXPECT_NE(refusalOf({.address = wrong, .cookie_file = folder / "none"}).find("an address of this machine"),
              std::string::npos)
        << wrong << ": " << refusalOf({.address = wrong, .cookie_file = folder / "none"});
}

TEST(BridgeDevice, FindsTheOnlyBridge) {
  const test::TempFolder folder;
  const test::Variable runtime("XDG_RUNTIME_DIR", folder.path());
  EXPECT_EQ(bridgeFolder(), folder / "filiform");
  EXPECT_TRUE(findBridges().empty());
  EXPECT_NE(refusalOf({}).find("no bridge listens"), std::string::npos);
  BridgeProcess bridge("");
  ASSERT_EQ(findBridges().size(), 1U);
  EXPECT_EQ(findBridges()[0].path, folder / "filiform/simulated.bridge");
  EXPECT_TRUE(findBridges()[0].listens);
  EXPECT_TRUE(eventually([] { return refusalOf({}).empty(); }));
  {
    const BridgeProcess second(folder / "filiform/other.bridge");
    EXPECT_NE(refusalOf({}).find("several bridges"), std::string::npos);
  }
  bridge.signal(SIGKILL);
  bridge.wait();
  EXPECT_EQ(findBridges().size(), 2U);
  EXPECT_FALSE(findBridges()[0].listens || findBridges()[1].listens) << "killed: their sockets stayed behind";
}

TEST(BridgeDevice, HasAFolderAlsoWithoutARuntimeFolder) {
  const test::Variable runtime("XDG_RUNTIME_DIR", std::nullopt);
  EXPECT_EQ(bridgeFolder(), "/tmp/filiform-" + std::to_string(::geteuid()));
}

}  // namespace
}  // namespace filiform
