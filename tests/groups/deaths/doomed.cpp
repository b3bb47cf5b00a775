// A program that renders a force of 1 N on a device and dies as it is told: doomed DEVICE DEATH. Prints "ready PID"
// with the device process once the force is whole, and dies at SIGUSR1.
#include "device/factory/device_factory.h"
#include "device/process/process_device.h"
#include "solver/force/force_hold.h"
#include "solver/loop/haptic_loop.h"

#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <string>
#include <thread>

namespace {

using namespace filiform;

[[gnu::noinline]] int overflow(int depth) {
  volatile char page[4096];
  page[0] = static_cast<char>(depth);
  return depth < 0 ? 0 : overflow(depth + 1) + page[0];
}

void run(const std::string& name, const std::string& death) {
  sigset_t begin;
  sigemptyset(&begin);
  sigaddset(&begin, SIGUSR1);
  pthread_sigmask(SIG_BLOCK, &begin, nullptr);
  holdForcesOnSignals();
  const std::unique_ptr<HapticDevice> device = makeDevice(name);
  device->open();
  std::atomic<bool> in_tick{false}, whole{false};
  HapticLoop loop(*device, [&](const DeviceState& state, double) {
    if (in_tick) std::printf("%d", overflow(0));
    if (state.sent_N && state.sent_N->norm() > 0.99) whole = true;
    Wrench wrench;
    wrench.force_N = {0, 0, -1};
    return wrench;
  });
  loop.start();
  while (loop.running() && !whole) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (!whole) throw DeviceError(loop.fault());
  const auto* const process = dynamic_cast<const ProcessDevice*>(device.get());
  std::printf("ready %d\n", process != nullptr ? process->processId() : -1);
  std::fflush(stdout);
  int signal = 0;
  sigwait(&begin, &signal);
  if (death == "overflow") std::printf("%d", overflow(0));
  if (death == "overflow in a tick") in_tick = true;
  if (death == "overflow in a worker") std::thread([] { std::printf("%d", overflow(0)); }).detach();
  if (death == "crash") std::raise(SIGSEGV);
  while (loop.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::fprintf(stderr, "%s\n", loop.fault().c_str());
  std::this_thread::sleep_for(std::chrono::seconds(60));
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run(argc > 1 ? argv[1] : "", argc > 2 ? argv[2] : "");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "doomed: %s\n", error.what());
  }
  return 1;
}
