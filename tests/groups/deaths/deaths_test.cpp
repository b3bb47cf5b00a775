// The table of deaths of device/README.md, "Zero force", with real processes: who dies, how, and what force the device
// was last told. Times are printed, not asserted.
#include "device/falcon/falcon.h"
#include "device/falcon/falcon_protocol.h"
#include "device/haply/simulated_haply_server.h"
#include "tests/groups/umockdev/mock_usb.h"
#include "tests/support/devices/bridge_process.h"
#include "tests/support/folders.h"
#include "tests/support/servers/started_process.h"
#include "tests/support/temp_folder.h"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <elf.h>
#include <fstream>
#include <sys/ptrace.h>
#include <sys/uio.h>
#include <sys/user.h>
#include <sys/wait.h>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using test::MockBytes;
using test::MockUsb;
using test::MockUsbDevice;
using test::StartedProcess;

constexpr double kFelt_N = 0.05;  // opening a Haply probes it with 0.02 N

double since_s(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

class Hardware {
 public:
  virtual ~Hardware() = default;
  virtual std::string device() const = 0;  // for --device
  virtual double acting_N() = 0;           // the force that it was last told
  virtual void unplug() = 0;
};

class HaplyHardware : public Hardware {
 public:
  std::string device() const override { return "haply:127.0.0.1:" + std::to_string(server_.port()); }
  double acting_N() override { return service_.acting_N(); }
  void unplug() override { service_.faults().ends = true; }

 private:
  static SimulatedHaplyOptions inRealTime() {
    SimulatedHaplyOptions options;
    options.is_led = true;
    options.clock = [begin = Clock::now()] { return since_s(begin); };
    return options;
  }
  SimulatedHaply service_{inRealTime()};
  SimulatedHaplyServer server_{service_};
};

// A homed Falcon behind the real libusb. The motors of a force of 1 N at the centre are 1 N.
class FalconHardware : public Hardware {
 public:
  FalconHardware() {
    UsbDeviceInfo info;
    info.vendor = kFalconVendor;
    info.product = kFalconProduct;
    info.bus_path = "1-1";
    info.interfaces = {{0, 0xff, 0xff, 0xff, {{0x81, UsbEndpointType::bulk, 64}, {0x02, UsbEndpointType::bulk, 64}}}};
    falcon_ = &usb_.plug(info);
    falcon_->onControl([](const UsbSetup&, const MockBytes&, MockUsbDevice&) { return MockBytes{}; });
    const auto angles = falconAngles(kFalconCentre_F);
    const auto counts = falconCountsOfAngles(*angles);
    MockBytes report{0x01, 0x60, '<'};  // after the bridge's status
    for (const std::int16_t count : counts)
      for (int k = 0; k < 4; ++k) report.push_back('A' + ((static_cast<std::uint16_t>(count) >> (4 * k)) & 15));
    for (const int byte : {'A' + 0x70, +'A', +'>'}) report.push_back(static_cast<std::uint8_t>(byte));
    const auto torques_Nm = falconTorques(kFalconCentre_F, {0, 0, -1});
    const auto whole = falconMotors(*torques_Nm, kFalconMotorPerNm);
    const double of_1_N = std::hypot(whole[0], whole[1], whole[2]);
    falcon_->onWrite([this, report, of_1_N](std::uint8_t, const MockBytes& bytes, MockUsbDevice& d) {
      if (bytes.size() != kFalconPacketBytes || bytes[0] != '<') return;
      double motors[3];
      for (std::size_t i = 0; i < 3; ++i) {
        unsigned bits = 0;
        for (std::size_t k = 0; k < 4; ++k) bits |= ((bytes[1 + 4 * i + k] - 'A') & 15U) << (4 * k);
        motors[i] = static_cast<std::int16_t>(bits);
      }
      acting_N_ = std::hypot(motors[0], motors[1], motors[2]) / of_1_N;
      d.answer(0x81, report);
    });
  }
  std::string device() const override { return "falcon"; }
  double acting_N() override { return acting_N_; }
  void unplug() override { usb_.unplug(*falcon_); }

 private:
  MockUsb usb_;
  MockUsbDevice* falcon_;
  std::atomic<double> acting_N_{0};
};

// The simulated bridge is its own device: its log is what it rendered.
class BridgeHardware : public Hardware {
 public:
  std::string device() const override { return "bridge:" + folder_.file("b"); }
  double acting_N() override {
    std::string line, last;
    std::ifstream log(folder_.file("log"));
    while (std::getline(log, line))
      if (!log.eof()) last = line;
    long long time_ns = 0, command_ns = 0;
    int mode = 0;
    double force_N = 0;
    std::sscanf(last.c_str(), "%lld %lld %d %lf", &time_ns, &command_ns, &mode, &force_N);
    return force_N;
  }
  void unplug() override {}

 private:
  test::TempFolder folder_;
  test::BridgeProcess bridge_{folder_.file("b"), folder_.file("log")};
};

enum class Injury : std::uint8_t { overflow, spin };

// Moves a process's stack pointer to where no stack is, as a recursion without end does; or has it spin where it is.
void injure(int process, Injury injury) {
  ASSERT_EQ(::ptrace(PTRACE_SEIZE, process, nullptr, nullptr), 0) << std::strerror(errno);
  ASSERT_EQ(::ptrace(PTRACE_INTERRUPT, process, nullptr, nullptr), 0) << std::strerror(errno);
  ASSERT_EQ(::waitpid(process, nullptr, __WALL), process);
  user_regs_struct registers{};
  iovec all{&registers, sizeof registers};
  ASSERT_EQ(::ptrace(PTRACE_GETREGSET, process, NT_PRSTATUS, &all), 0) << std::strerror(errno);
#if defined(__x86_64__)
  auto &stack = registers.rsp, &next = registers.rip;
  constexpr long kToItself = 0xfeeb;  // jmp
#else
  auto &stack = registers.sp, &next = registers.pc;
  constexpr long kToItself = 0x14000000;  // b
#endif
  if (injury == Injury::overflow) stack = 4096;
  ASSERT_TRUE(injury != Injury::spin || ::ptrace(PTRACE_POKETEXT, process, next, kToItself) == 0)
      << std::strerror(errno);
  ASSERT_EQ(::ptrace(PTRACE_SETREGSET, process, NT_PRSTATUS, &all), 0) << std::strerror(errno);
  ASSERT_EQ(::ptrace(PTRACE_DETACH, process, nullptr, nullptr), 0) << std::strerror(errno);
}

struct Death {
  const char* who;
  const char* how;
  int signal;  // to the program or the device process; 0: an injury of the process, or a program by itself
};

constexpr Death kOfProgram[] = {
    {"program", "SIGKILL", SIGKILL}, {"program", "SIGSTOP", SIGSTOP},      {"program", "crash", 0},
    {"program", "overflow", 0},      {"program", "overflow in a tick", 0}, {"program", "overflow in a worker", 0}};
constexpr Death kOfDeviceProcess[] = {{"device process", "SIGKILL", SIGKILL},
                                      {"device process", "crash in the exchange", SIGSEGV},
                                      {"device process", "hang in the exchange", SIGSTOP},
                                      {"device process", "overflow", 0},
                                      {"device process", "spin in the exchange", 0},
                                      {"device process", "SIGTERM", SIGTERM}};

// Lets the program render 1 N, lets it die, and prints a row. Returns the last force.
double lastForceAfter(Hardware& hardware, const Death& death, const std::string& suffix = "") {
  StartedProcess program({test::inBuild("filiform_doomed"), hardware.device() + suffix, death.how}, "/dev/null");
  int device_process = -1;
  std::sscanf(program.line().c_str(), "ready %d", &device_process);
  const double before_N = hardware.acting_N();
  const auto begin = Clock::now();
  const bool of_device = std::string(death.who) == "device process";
  if (death.who == std::string("device"))
    hardware.unplug();
  else if (of_device && death.signal == 0)
    injure(device_process, death.how == std::string("overflow") ? Injury::overflow : Injury::spin);
  else if (of_device)
    ::kill(device_process, death.signal);
  else
    program.signal(death.signal != 0 ? death.signal : SIGUSR1);
  double last_s = 0, last_N = before_N;
  while (since_s(begin) < 2 && since_s(begin) - last_s < 0.6) {
    last_N = hardware.acting_N();
    if (last_N > kFelt_N) last_s = since_s(begin);
    std::this_thread::sleep_for(200us);
  }
  char after[32] = "stays";
  if (last_N <= kFelt_N) std::snprintf(after, sizeof after, "%.1f ms", 1e3 * last_s);
  std::printf("| %-16s | %-14s | %-21s | %4.2f | %4.2f | %9s |\n",
              (hardware.device().substr(0, hardware.device().find(':')) + suffix).c_str(), death.who, death.how,
              before_N, last_N, after);
  if (death.signal == SIGSTOP && !of_device) program.signal(SIGCONT);
  return last_N;
}

class Deaths : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::printf("| device           | who            | how                   | N before | last N | zero after |\n");
  }
};

TEST_F(Deaths, OfAProgramWithAHaplyEndInZero) {
  for (const Death& death : kOfProgram) {
    HaplyHardware haply;
    EXPECT_EQ(lastForceAfter(haply, death), 0) << death.how;
  }
}

TEST_F(Deaths, OfTheProcessOfAHaplyEndInZero) {
  for (const Death& death : kOfDeviceProcess) {
    HaplyHardware haply;
    EXPECT_EQ(lastForceAfter(haply, death), 0) << death.how;
  }
  HaplyHardware haply;
  EXPECT_EQ(lastForceAfter(haply, {"device", "service ends", 0}), 0);
}

TEST_F(Deaths, OfAProgramWithAFalconEndInZero) {
  if (const std::string why = MockUsb::missing(); !why.empty()) GTEST_SKIP() << why;
  for (const Death& death : kOfProgram) {
    FalconHardware falcon;
    EXPECT_EQ(lastForceAfter(falcon, death), 0) << death.how;
  }
}

TEST_F(Deaths, OfTheProcessOfAFalconEndInZero) {
  if (const std::string why = MockUsb::missing(); !why.empty()) GTEST_SKIP() << why;
  for (const Death& death : kOfDeviceProcess) {
    FalconHardware falcon;
    EXPECT_EQ(lastForceAfter(falcon, death), 0) << death.how;
  }
  FalconHardware falcon;  // no host can reach it: HARDWARE.md says what is unknown
  lastForceAfter(falcon, {"device", "unplugged", 0});
}

TEST_F(Deaths, OfAProgramWithABridgeEndInZero) {
  for (const Death& death : kOfProgram) {
    BridgeHardware bridge;
    EXPECT_EQ(lastForceAfter(bridge, death), 0) << death.how;
  }
}

// Without the device process, the guard sends zero where a handler can run; the rest stays, as the table says.
TEST_F(Deaths, InTheProcessItselfASignalHandlerSendsZero) {
  for (const Death& death : kOfProgram) {
    HaplyHardware haply;
    const double last_N = lastForceAfter(haply, death, ",direct");
    EXPECT_TRUE(last_N == 0 || death.signal == SIGSTOP) << death.how;
  }
}

}  // namespace
}  // namespace filiform
