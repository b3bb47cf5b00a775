// The safety of the haptic loop: the force is zero while a tick blocks, while forces are held, before the process dies
// or stops, and at the end; it comes back over the ramp.
#include "device/falcon/falcon.h"
#include "solver/force/force_hold.h"
#include "solver/loop/haptic_loop.h"
#include "tests/support/devices/fake_falcon.h"
#include "tests/support/devices/haptic_loops.h"
#include "tests/support/sanitized.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <new>
#include <span>
#include <sys/mman.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using namespace std::chrono_literals;
using test::push;
using test::quietLoop;
using test::soon;

// The forces that a device was sent, with times. A forked child shares the memory, so the log outlives the child.
struct SentLog {
  static constexpr std::size_t kMost = 100'000;
  struct Sent {
    std::int64_t time_ns;
    double force_N;
  };
  std::atomic<std::size_t> count{0};
  std::atomic<std::int64_t> event_ns{0};  // begin of the disturbance by the test
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
  // Time (s) from the event to the first zero force; NaN: none was sent.
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
  LoggingDevice(SentLog& log, bool paces, bool renders_model = false) : log_(log) {
    capabilities_.paces_loop = paces;
    capabilities_.renders_model = renders_model;
  }
  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return DeviceStatus::ready; }
  void open() override {}
  void close() noexcept override {}
  DeviceState exchange(const Wrench& wrench) noexcept override {
    EXPECT_FALSE(inside_.exchange(true)) << "two threads exchange with the device at the same time";
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
  HapticLoopOptions options = quietLoop();
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
    // After the first zero, the force is zero until the tick returns, and then never steps up.
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

// Such a device lets the force fade by itself, and ramps by itself.
TEST(HapticLoop, ADeviceThatRendersTheModelIsLeftAloneWhileATickBlocks) {
  for (const bool paces : {false, true}) {
    SharedLog log;
    LoggingDevice device(*log, paces, true);
    std::atomic<bool> block{false}, blocked{false};
    HapticLoop loop(
        device,
        [&](const DeviceState&, double) {
          if (block.exchange(false)) {
            blocked = true;
            std::this_thread::sleep_for(60ms);
          }
          return push(1);
        },
        rampOf(0.05));
    loop.start();
    ASSERT_TRUE(soon([&] { return log->last_N() == 1; }));
    const std::size_t before = log->count;
    block = true;
    ASSERT_TRUE(soon([&] { return blocked && log->count > before + 20; }));
    for (std::size_t i = before; i < before + 20; ++i) EXPECT_EQ(log->sent[i].force_N, 1);
    EXPECT_EQ(loop.guard_exchanges(), 0u);
    EXPECT_EQ(loop.interruptions(), 0u);
    holdForces();  // the guard still answers signals, and the force then grows from zero
    EXPECT_EQ(log->last_N(), 0);
    const std::size_t held = log->count;
    releaseForces();
    ASSERT_TRUE(soon([&] { return log->last_N() == 1; }));
    bool grew = false;
    for (std::size_t i = held; i < log->count; ++i)
      grew = grew || (log->sent[i].force_N > 0 && log->sent[i].force_N < 1);
    EXPECT_TRUE(grew);
    loop.stop();
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
    std::this_thread::sleep_for(500us);  // the fake device's clock is virtual
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
    options.stall_s = 10;  // a busy machine must not cause an interruption
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

TEST(HapticLoop, HeldForcesAreZeroUntilReleased) {
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
  holdForces();  // without a loop it returns at once
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

[[gnu::noinline]] int overflow(int depth) {
  volatile char page[4096];
  page[0] = static_cast<char>(depth);
  return depth < 0 ? 0 : overflow(depth + 1) + page[0];
}

// Forks a child that runs a loop until its force is whole, then calls `what` there.
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
                            Case{SIGSEGV, paces, [](std::atomic<bool>&) { overflow(0); }},
                            Case{SIGSEGV, paces,
                                 [](std::atomic<bool>&) {
                                   std::thread([] {
                                     giveSignalStack();
                                     overflow(0);
                                   }).join();
                                 }},
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
  if (test::kSanitized) GTEST_SKIP() << "the loop is so slow that the guard interrupts it";
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

}  // namespace
}  // namespace filiform
