#include "solver/loop/haptic_loop.h"

#include "device/falcon/falcon.h"
#include "device/simulated/null_device.h"
#include "device/simulated/simulated_hand.h"
#include "index/errors.h"
#include "solver/force/force_hold.h"
#include "tests/support/fake_falcon.h"
#include "tests/support/sanitized.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <functional>
#include <limits>
#include <pthread.h>
#include <stdexcept>
#include <sys/mman.h>
#include <sys/wait.h>
#include <system_error>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using namespace std::chrono_literals;

// A device that a test may watch and change while the loop runs.
class WatchedDevice : public HapticDevice {
 public:
  explicit WatchedDevice(bool paces = false) { capabilities_.paces_loop = paces; }
  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return status_; }
  void open() override {}
  void close() noexcept override {}
  DeviceState exchange(const Wrench& wrench) noexcept override {
    if (capabilities_.paces_loop) std::this_thread::sleep_for(1ms);
    if (last_force_N == 0) rose_to_N = wrench.force_N.x();
    last_force_N = wrench.force_N.x();
    ++exchanges;
    DeviceState state;
    if (!frozen) ++periods_;
    state.time_s = 0.001 * periods_;
    state.status = status_;
    return state;
  }
  void setStatus(DeviceStatus status) { status_ = status; }

  std::atomic<double> last_force_N{0}, rose_to_N{0};  // the latter: the first one after zero
  std::atomic<int> exchanges{0};
  std::atomic<bool> frozen{false};

 private:
  DeviceCapabilities capabilities_;
  std::atomic<DeviceStatus> status_{DeviceStatus::ready};
  int periods_ = 0;
};

HapticLoopOptions quiet() {
  HapticLoopOptions options;
  options.realtime_priority = options.lock_memory = false;
  return options;
}

// Without the guard, which takes the force away whenever a busy machine is late, so that it might never be whole.
HapticLoopOptions unguarded() {
  HapticLoopOptions options = quiet();
  options.stall_s = 0;
  return options;
}

template <class Condition>
bool soon(Condition condition) {  // generous: what is waited for happens within milliseconds
  for (int i = 0; i < 20000 && !condition(); ++i) std::this_thread::sleep_for(1ms);
  return condition();
}

Wrench push(double force_N) {
  Wrench wrench;
  wrench.force_N.x() = force_N;
  return wrench;
}

TEST(HapticLoop, TicksAndSendsZeroForceAtStop) {
  WatchedDevice device;
  std::atomic<int> ticks{0};
  HapticLoop loop(device, [&](const DeviceState&, double dt_s) {
    EXPECT_GT(dt_s, 0);
    ++ticks;
    return push(1);
  });
  loop.start();
  ASSERT_TRUE(loop.running());
  ASSERT_TRUE(soon([&] { return ticks > 100 && device.last_force_N == 1; }));
  loop.stop();
  EXPECT_FALSE(loop.running());
  EXPECT_EQ(device.last_force_N, 0);
  EXPECT_EQ(static_cast<std::uint64_t>(device.exchanges),
            static_cast<std::uint64_t>(ticks) + 1 + loop.guard_exchanges());
  EXPECT_EQ(loop.metrics().ticks(), static_cast<std::uint64_t>(ticks));
  EXPECT_EQ(loop.metrics().exchange().count(), loop.metrics().ticks());
  EXPECT_EQ(loop.fault(), "");
  for (const std::string& refusal : loop.refusals()) EXPECT_NE(refusal.find("may delay"), std::string::npos) << refusal;
}

TEST(HapticLoop, RunsASimulatedHandAndANullDevice) {
  SimulatedHand hand({});
  NullDevice null;
  for (HapticDevice* device : {static_cast<HapticDevice*>(&hand), static_cast<HapticDevice*>(&null)}) {
    device->open();
    std::atomic<int> ready{0};
    HapticLoop loop(
        *device,
        [&](const DeviceState& state, double dt_s) {
          ready += state.status == DeviceStatus::ready;
          EXPECT_NEAR(dt_s, 0.001, 1e-9);
          return push(0.5);
        },
        unguarded());  // a guard's exchange takes a period of the null device's time
    loop.start();
    EXPECT_TRUE(soon([&] { return ready > 20; }));
    loop.stop();
    device->close();
  }
  EXPECT_EQ(null.lastWrench().force_N, Eigen::Vector3d::Zero());
}

TEST(HapticLoop, IsPacedByADeviceThatPaces) {
  WatchedDevice device(true);
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(1); }, quiet());
  loop.start();
  ASSERT_TRUE(soon([&] { return loop.ticks() > 20; }));
  loop.stop();
  EXPECT_EQ(loop.metrics().wake().max_ns(), 0);
  EXPECT_GE(loop.metrics().exchange().percentile_ns(0.5), 1'000'000);
  EXPECT_EQ(device.last_force_N, 0);
}

TEST(HapticLoop, ExceptionInTheTickEndsItWithZeroForce) {
  WatchedDevice device;
  int ticks = 0;
  HapticLoop loop(
      device,
      [&](const DeviceState&, double) -> Wrench {
        if (++ticks > 10) throw std::runtime_error("no");
        return push(1);
      },
      quiet());
  loop.start();
  ASSERT_TRUE(soon([&] { return !loop.running(); }));
  EXPECT_EQ(device.last_force_N, 0);
  EXPECT_NE(loop.fault(), "");
  loop.stop();
}

TEST(HapticLoop, FaultOfTheDeviceEndsItWithZeroForceAndItCanStartAgain) {
  WatchedDevice device;
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(1); }, unguarded());
  loop.start();
  ASSERT_TRUE(soon([&] { return device.last_force_N == 1; }));
  device.setStatus(DeviceStatus::fault);
  ASSERT_TRUE(soon([&] { return !loop.running(); }));
  EXPECT_EQ(device.last_force_N, 0);
  EXPECT_NE(loop.fault().find("device"), std::string::npos);
  device.setStatus(DeviceStatus::ready);
  loop.start();
  EXPECT_EQ(loop.fault(), "");
  EXPECT_TRUE(soon([&] { return device.last_force_N == 1; }));
}  // the destructor stops it

TEST(HapticLoop, SendsNoForceBeforeTheDeviceIsReady) {
  WatchedDevice device;
  device.setStatus(DeviceStatus::homing);
  std::atomic<int> ticks{0};
  HapticLoop loop(
      device,
      [&](const DeviceState&, double) {
        ++ticks;
        return push(1);
      },
      unguarded());
  loop.start();
  ASSERT_TRUE(soon([&] { return ticks > 20; }));
  EXPECT_EQ(device.last_force_N, 0);
  device.setStatus(DeviceStatus::ready);
  EXPECT_TRUE(soon([&] { return device.last_force_N == 1; }));
}

TEST(HapticLoop, WatchdogTakesTheForceFromADeviceThatStandsStill) {
  WatchedDevice device;
  HapticLoopOptions options = unguarded();
  options.watchdog_s = 0.02;
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(1); }, options);
  loop.start();
  ASSERT_TRUE(soon([&] { return device.last_force_N == 1; }));
  device.frozen = true;
  ASSERT_TRUE(soon([&] { return device.last_force_N == 0; }));
  EXPECT_GT(loop.stale_ticks(), 0u);
  device.frozen = false;
  EXPECT_TRUE(soon([&] { return device.last_force_N == 1; }));
}

TEST(HapticLoop, AForceThatIsWithheldIsZeroAndComesBackByTheRamp) {
  WatchedDevice device;
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(1); }, unguarded());
  loop.start();
  ASSERT_TRUE(soon([&] { return device.last_force_N == 1; }));
  loop.withhold(true);
  ASSERT_TRUE(soon([&] { return device.last_force_N == 0; }));
  const int exchanges = device.exchanges;
  ASSERT_TRUE(soon([&] { return device.exchanges > exchanges + 20; }));
  EXPECT_EQ(device.last_force_N, 0);
  loop.withhold(false);
  ASSERT_TRUE(soon([&] { return device.last_force_N > 0; }));
  EXPECT_LT(device.rose_to_N, 0.9);
  EXPECT_TRUE(soon([&] { return device.last_force_N == 1; }));
}

TEST(HapticLoop, SendsZeroForAForceThatIsNotFinite) {
  WatchedDevice device;
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(std::numeric_limits<double>::quiet_NaN()); }, quiet());
  loop.start();
  ASSERT_TRUE(soon([&] { return loop.ticks() > 10; }));
  EXPECT_EQ(device.last_force_N, 0);
}

TEST(HapticLoop, CountsTicksThatOverrunAsMissedDeadlinesAndSkipsThem) {
  WatchedDevice device;
  HapticLoop loop(
      device,
      [](const DeviceState&, double) {
        std::this_thread::sleep_for(5ms);
        return Wrench{};
      },
      quiet());
  loop.start();
  ASSERT_TRUE(soon([&] { return loop.ticks() >= 5; }));
  loop.stop();
  EXPECT_EQ(loop.metrics().missed_deadlines(), loop.metrics().ticks());
}

// What a device was sent, and when: in memory that a forked child shares, so that it outlives the child.
struct SentLog {
  static constexpr std::size_t kMost = 100'000;
  struct Sent {
    std::int64_t time_ns;
    double force_N;
  };
  std::atomic<std::size_t> count{0};
  std::atomic<std::int64_t> event_ns{0};  // when what a test does to the loop began
  std::array<Sent, kMost> sent;

  static std::int64_t now_ns() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }
  void add(double force_N) {
    const std::size_t at = count.load();
    if (at < kMost) sent[at] = {now_ns(), force_N};
    count.store(std::min(at + 1, kMost));
  }
  double last_N() const { return count == 0 ? 0.0 : sent[count - 1].force_N; }
  // Of the first zero after the event (s); NaN if none came.
  double zeroAfterEvent_s() const {
    for (std::size_t i = 0; i < count; ++i)
      if (sent[i].time_ns >= event_ns && sent[i].force_N == 0)
        return 1e-9 * static_cast<double>(sent[i].time_ns - event_ns);
    return std::numeric_limits<double>::quiet_NaN();
  }
};

class SharedLog {
 public:
  SharedLog()
      : log_(static_cast<SentLog*>(
            mmap(nullptr, sizeof(SentLog), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0))) {
    new (log_) SentLog;
  }
  ~SharedLog() { munmap(log_, sizeof(SentLog)); }
  SentLog* operator->() { return log_; }
  SentLog& operator*() { return *log_; }

 private:
  SentLog* log_;
};

class LoggingDevice : public HapticDevice {
 public:
  LoggingDevice(SentLog& log, bool paces) : log_(log) { capabilities_.paces_loop = paces; }
  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return DeviceStatus::ready; }
  void open() override {}
  void close() noexcept override {}
  DeviceState exchange(const Wrench& wrench) noexcept override {
    EXPECT_FALSE(inside_.exchange(true)) << "two threads at the device at once";
    if (capabilities_.paces_loop) std::this_thread::sleep_for(1ms);
    log_.add(wrench.force_N.x());
    DeviceState state;
    state.time_s = 0.001 * ++exchanges_;
    state.status = DeviceStatus::ready;
    inside_ = false;
    return state;
  }

 private:
  SentLog& log_;
  DeviceCapabilities capabilities_;
  int exchanges_ = 0;
  std::atomic<bool> inside_{false};
};

HapticLoopOptions rampOf(double ramp_s) {
  HapticLoopOptions options = quiet();
  options.ramp_s = ramp_s;
  return options;
}

TEST(HapticLoop, TheGuardSendsZeroWhileATickBlocksAndTheForceComesBackByTheRamp) {
  for (const bool paces : {false, true}) {
    SharedLog log;
    LoggingDevice device(*log, paces);
    std::atomic<bool> block{false}, blocked{false};
    HapticLoop loop(
        device,
        [&](const DeviceState&, double) {
          if (block.exchange(false)) {
            log->event_ns = SentLog::now_ns();
            blocked = true;
            std::this_thread::sleep_for(600ms);
          }
          return push(1);
        },
        rampOf(0.4));
    loop.start();
    ASSERT_TRUE(soon([&] { return log->last_N() == 1; }));
    const std::uint64_t before = loop.interruptions();
    block = true;
    ASSERT_TRUE(soon([&] { return blocked && log->last_N() == 0; }));
    ASSERT_TRUE(soon([&] { return log->last_N() == 1; }));
    loop.stop();
    EXPECT_GT(loop.guard_exchanges(), 1u);
    EXPECT_GT(loop.interruptions(), before);
    const double zero_s = log->zeroAfterEvent_s();
    std::printf("force was zero %.1f ms after the tick had blocked (%s)\n", 1e3 * zero_s,
                paces ? "the device paces" : "the clock paces");
    EXPECT_LT(zero_s, 0.5);
    // From then on zero until the tick is back, and then no step up.
    bool zero_seen = false;
    double last_N = 0;
    for (std::size_t i = 0; i < log->count; ++i) {
      const auto& [time_ns, force_N] = log->sent[i];
      if (time_ns < log->event_ns) continue;
      zero_seen = zero_seen || force_N == 0;
      if (zero_seen && time_ns < log->event_ns + 590'000'000) {
        EXPECT_EQ(force_N, 0);
      }
      if (zero_seen && last_N == 0) {
        EXPECT_LT(force_N, 0.5);
      }
      if (zero_seen) last_N = force_N;
    }
  }
}

TEST(HapticLoop, AFalconIsSentZeroWhileTheTickBlocksAndAtTheEnd) {
  test::FakeUsb usb;
  test::FakeFalcon fake(usb);
  fake.powerUp(true);
  Falcon falcon(usb);
  falcon.open();
  falcon.exchange({});
  fake.home();
  std::atomic<bool> zero{true};
  const auto received = fake.usb_device().on_write;
  fake.usb_device().on_write = [&](std::uint8_t endpoint, std::span<const std::uint8_t> bytes,
                                   test::FakeUsbDevice& device) {
    received(endpoint, bytes, device);
    zero = fake.last().isZero();
    std::this_thread::sleep_for(500us);  // the fake's own clock is virtual
  };
  std::atomic<bool> block{false};
  HapticLoop loop(
      falcon,
      [&](const DeviceState&, double) {
        while (block) std::this_thread::sleep_for(1ms);
        return push(2);
      },
      rampOf(0.05));
  loop.start();
  ASSERT_TRUE(soon([&] { return !zero; }));
  block = true;
  EXPECT_TRUE(soon([&] { return zero.load(); }));
  block = false;
  EXPECT_TRUE(soon([&] { return !zero; }));
  loop.stop();
  EXPECT_TRUE(fake.last().isZero());
  EXPECT_EQ(falcon.status(), DeviceStatus::ready);
  EXPECT_TRUE(usb.violations().empty()) << usb.violations().front();
}

TEST(HapticLoop, WithoutAStallTimeThereIsNoGuard) {
  SharedLog log;
  LoggingDevice device(*log, false);
  HapticLoopOptions options = rampOf(0);
  options.stall_s = 0;
  std::atomic<int> ticks{0};
  HapticLoop loop(
      device,
      [&](const DeviceState&, double) {
        if (++ticks == 20) std::this_thread::sleep_for(100ms);
        return push(1);
      },
      options);
  loop.start();
  ASSERT_TRUE(soon([&] { return ticks > 40; }));
  loop.stop();
  EXPECT_EQ(loop.guard_exchanges(), 0u);
  EXPECT_EQ(loop.interruptions(), 0u);
  EXPECT_EQ(log->last_N(), 0);
}

TEST(HapticLoop, TheForceRampsUpAtTheStartUnlessTheTickDoesThatItself) {
  for (const bool ramp : {true, false}) {
    SharedLog log;
    LoggingDevice device(*log, false);
    HapticLoopOptions options = rampOf(0.2);
    options.ramp_at_start = ramp;
    options.fade_s = 0;
    options.stall_s = 10;  // a busy machine must not interrupt
    HapticLoop loop(
        device, [](const DeviceState&, double) { return push(1); }, options);
    loop.start();
    ASSERT_TRUE(soon([&] { return log->last_N() == 1; }));
    loop.stop();
    const std::size_t whole = static_cast<std::size_t>(
        std::count_if(log->sent.begin(), log->sent.begin() + static_cast<std::ptrdiff_t>(log->count.load()),
                      [](const SentLog::Sent& sent) { return sent.force_N > 0 && sent.force_N < 1; }));
    EXPECT_EQ(whole > 0, ramp);
  }
}

TEST(HapticLoop, HeldForcesAreZeroUntilTheyAreLetGo) {
  for (const bool paces : {false, true}) {
    SharedLog log;
    LoggingDevice device(*log, paces);
    HapticLoop loop(
        device, [](const DeviceState&, double) { return push(1); }, rampOf(0.05));
    loop.start();
    ASSERT_TRUE(soon([&] { return log->last_N() == 1; }));
    log->event_ns = SentLog::now_ns();
    holdForces();
    const double held_s = 1e-9 * static_cast<double>(SentLog::now_ns() - log->event_ns);
    std::printf("holding took %.1f ms, zero was sent after %.1f ms\n", 1e3 * held_s, 1e3 * log->zeroAfterEvent_s());
    ASSERT_TRUE(soon([&] { return log->last_N() == 0; }));
    const std::size_t from = log->count;
    std::this_thread::sleep_for(100ms);
    for (std::size_t i = from; i < log->count; ++i) EXPECT_EQ(log->sent[i].force_N, 0);
    releaseForces();
    EXPECT_TRUE(soon([&] { return log->last_N() == 1; }));
    loop.stop();
    EXPECT_EQ(log->last_N(), 0);
  }
  holdForces();  // without a loop there is nobody to wait for
  releaseForces();
}

TEST(HapticLoop, StoppingWhileForcesAreHeldEnds) {
  SharedLog log;
  LoggingDevice device(*log, true);
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(1); }, rampOf(0.05));
  loop.start();
  ASSERT_TRUE(soon([&] { return log->last_N() == 1; }));
  holdForces();
  loop.stop();
  releaseForces();
  EXPECT_EQ(log->last_N(), 0);
}

// Runs a loop in a child until its force is whole, then lets `what` happen there.
pid_t loopInChild(SentLog& log, bool paces, const std::function<void(std::atomic<bool>& crash_in_tick)>& what) {
  const pid_t child = fork();
  if (child != 0) return child;
  std::atomic<bool> crash{false};
  LoggingDevice device(log, paces);
  HapticLoop loop(
      device,
      [&](const DeviceState&, double) {
        if (crash) {
          volatile int* nowhere = nullptr;
          *nowhere = 1;  // NOLINT(clang-analyzer-core.NullDereference)
        }
        return push(1);
      },
      rampOf(0.2));
  loop.start();
  holdForcesOnSignals();
  if (!soon([&] { return log.last_N() == 1; })) _exit(3);
  log.event_ns = SentLog::now_ns();
  what(crash);
  std::this_thread::sleep_for(60s);
  _exit(4);
}

TEST(HapticLoop, ACrashSendsZeroBeforeTheProcessDies) {
  if (test::kSanitized) GTEST_SKIP() << "the sanitizer handles these signals";
  struct Case {
    int signal;
    bool paces;
    std::function<void(std::atomic<bool>&)> what;
  };
  for (const bool paces : {false, true})
    for (const Case& one : {Case{SIGSEGV, paces, [](std::atomic<bool>& crash) { crash = true; }},
                            Case{SIGABRT, paces, [](std::atomic<bool>&) { std::abort(); }},
                            Case{SIGHUP, paces, [](std::atomic<bool>&) { std::raise(SIGHUP); }}}) {
      SharedLog log;
      const pid_t child = loopInChild(*log, one.paces, one.what);
      ASSERT_GT(child, 0);
      int status = 0;
      ASSERT_EQ(waitpid(child, &status, 0), child);
      ASSERT_TRUE(WIFSIGNALED(status)) << status;
      EXPECT_EQ(WTERMSIG(status), one.signal);
      EXPECT_EQ(log->last_N(), 0) << one.signal << (one.paces ? " paced" : "");
      std::printf("signal %d: zero %.1f ms later\n", one.signal, 1e3 * log->zeroAfterEvent_s());
    }
}

TEST(HapticLoop, AStoppedProcessBeginsWithZeroAndTheRampWhenItIsContinued) {
  if (test::kSanitized) GTEST_SKIP() << "slow enough to be interrupted by itself";
  for (const int signal : {SIGSTOP, SIGTSTP}) {
    SharedLog log;
    const pid_t child = loopInChild(*log, false, [](std::atomic<bool>&) {});
    ASSERT_GT(child, 0);
    ASSERT_TRUE(soon([&] { return log->event_ns != 0; }));
    kill(child, signal);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, WUNTRACED), child);
    ASSERT_TRUE(WIFSTOPPED(status));
    if (signal == SIGTSTP) {
      EXPECT_EQ(log->last_N(), 0);
    }
    const std::size_t before = log->count;
    std::this_thread::sleep_for(300ms);
    EXPECT_EQ(log->count, before);
    kill(child, SIGCONT);
    ASSERT_TRUE(soon([&] { return log->count > before + 20; }));
    EXPECT_EQ(log->sent[before].force_N, 0);
    double last_N = 0;
    for (std::size_t i = before; i < before + 20; ++i) {
      EXPECT_LE(log->sent[i].force_N - last_N, 0.5);
      last_N = log->sent[i].force_N;
    }
    EXPECT_TRUE(soon([&] { return log->last_N() == 1; }));
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
  }
}

TEST(HapticLoop, StoppingLetsTheForceFade) {
  SharedLog log;
  LoggingDevice device(*log, false);
  HapticLoopOptions options = rampOf(0.02);
  options.stall_s = 0;
  options.fade_s = 0.4;
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(1); }, options);
  loop.start();
  ASSERT_TRUE(soon([&] { return log->last_N() == 1; }));
  loop.stop();
  EXPECT_EQ(log->last_N(), 0);
  const auto begin = log->sent.begin(), end = begin + static_cast<std::ptrdiff_t>(log->count.load());
  const auto whole = std::find_if(begin, end, [](const SentLog::Sent& sent) { return sent.force_N == 1; });
  std::size_t between = 0;
  for (auto one = whole; one + 1 < end; ++one) {
    EXPECT_LE((one + 1)->force_N, one->force_N);
    between += one->force_N > 0 && one->force_N < 1;
  }
  EXPECT_GT(between, 0u);
}

TEST(HapticLoop, TellsTheTickWhatWasReallySent) {
  WatchedDevice device;
  std::atomic<bool> withheld_seen{false}, whole_seen{false};
  HapticLoop loop(
      device,
      [&](const DeviceState& state, double) {
        if (state.sent_N && state.sent_N->x() == 1) whole_seen = true;
        if (whole_seen && state.sent_N && state.sent_N->isZero(0)) withheld_seen = true;
        return push(1);
      },
      unguarded());
  loop.start();
  EXPECT_TRUE(soon([&] { return whole_seen.load(); }));
  loop.withhold(true);
  EXPECT_TRUE(soon([&] { return withheld_seen.load(); }));
}

TEST(HapticLoop, AThreadThatCannotBeMadeLeavesTheLoopStopped) {
  if (test::kSanitized) GTEST_SKIP() << "the sanitizer makes its own threads";
  WatchedDevice device;
  HapticLoop loop(
      device, [](const DeviceState&, double) { return push(1); }, quiet());
  pthread_attr_t usual, huge;
  ASSERT_EQ(pthread_getattr_default_np(&usual), 0);
  ASSERT_EQ(pthread_attr_init(&huge), 0);
  ASSERT_EQ(pthread_attr_setstacksize(&huge, std::size_t{1} << 47), 0);  // more than there are addresses
  ASSERT_EQ(pthread_setattr_default_np(&huge), 0);
  EXPECT_THROW(loop.start(), std::system_error);
  ASSERT_EQ(pthread_setattr_default_np(&usual), 0);
  EXPECT_FALSE(loop.running());
  EXPECT_EQ(device.exchanges, 0);
  loop.start();
  EXPECT_TRUE(soon([&] { return loop.ticks() > 10; }));
  loop.stop();
  pthread_attr_destroy(&usual);
  pthread_attr_destroy(&huge);
}

TEST(HapticLoop, RefusesTimesThatAreNone) {
  NullDevice device;
  for (double HapticLoopOptions::*option : {&HapticLoopOptions::watchdog_s, &HapticLoopOptions::stall_s,
                                            &HapticLoopOptions::ramp_s, &HapticLoopOptions::fade_s}) {
    for (const double bad : {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      HapticLoopOptions options;
      options.*option = bad;
      EXPECT_THROW(HapticLoop(
                       device, [](const DeviceState&, double) { return Wrench{}; }, options),
                   UsageError);
    }
  }
}

TEST(HapticLoop, RefusesARateThatIsNone) {
  NullDevice device;
  for (const double rate_Hz :
       {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    HapticLoopOptions options;
    options.rate_Hz = rate_Hz;
    EXPECT_THROW(HapticLoop(
                     device, [](const DeviceState&, double) { return Wrench{}; }, options),
                 UsageError);
  }
}

}  // namespace
}  // namespace filiform
