// filiform-device: holds a device that renders force in a process of its own, as a bridge (device/BRIDGE.md). filiform
// starts it for --device falcon and --device haply, so that the force fades whatever happens to filiform.
#include "device/factory/device_factory.h"
#include "tools/bridges/bridge.h"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <sched.h>
#include <string>

namespace {

using filiform::DeviceCapabilities;
using filiform::DeviceState;
using filiform::DeviceStatus;
using filiform::HapticDevice;

struct Held {
  std::unique_ptr<HapticDevice> device;
  std::int64_t begin_ns = 0;  // of the device's clock, on the bridge's
};

int exchangeHeld(void* self, const double* force_N, fb_state* state) {
  Held& held = *static_cast<Held*>(self);
  filiform::Wrench wrench;
  std::copy_n(force_N, 3, wrench.force_N.data());
  const DeviceState found = held.device->exchange(wrench);
  const auto time_ns = static_cast<std::int64_t>(1e9 * found.time_s);
  // The sample that came with the least delay tells best.
  const std::int64_t begin_ns = bridge_now_ns() - time_ns;
  if (held.begin_ns == 0 || begin_ns < held.begin_ns) held.begin_ns = begin_ns;
  state->time_ns = held.begin_ns + time_ns;
  std::copy_n(found.p_D.data(), 3, state->p_D);
  std::copy_n(found.v_D.data(), 3, state->v_D);
  std::copy_n(found.orientation_D.coeffs().data(), 4, state->orientation);
  std::copy_n(found.sent_N.value_or(wrench.force_N).data(), 3, state->force_N);
  state->buttons = found.buttons;
  return found.status == DeviceStatus::ready ? 1 : found.status == DeviceStatus::fault ? -1 : 0;
}

const char* adviceOfHeld(void* self) { return static_cast<Held*>(self)->device->advice(); }

void leadHeld(void* self, const double* aim_D) {
  static_cast<Held*>(self)->device->lead(Eigen::Vector3d(aim_D[0], aim_D[1], aim_D[2]));
}

bridge_device bridgeTo(Held& held) {
  const DeviceCapabilities& can = held.device->capabilities();
  bridge_device bridge{};
  bridge.self = &held;
  bridge.exchange = exchangeHeld;
  bridge.advice = adviceOfHeld;
  bridge.lead = leadHeld;
  fb_hello& hello = bridge.hello;
  hello.flags = FB_KNOWS_VELOCITY | FB_PACES | static_cast<std::uint32_t>(can.delay_samples & 15) << FB_DELAY_SHIFT;
  if (can.senses_orientation) hello.flags |= FB_KNOWS_ORIENTATION;
  if (can.is_led) hello.flags |= FB_IS_LED;
  if (can.needs_homing) hello.flags |= FB_HOMES;
  hello.buttons = static_cast<std::uint32_t>(can.buttons);
  std::copy_n(can.workspace_lo_D.data(), 3, hello.lo_D);
  std::copy_n(can.workspace_hi_D.data(), 3, hello.hi_D);
  hello.peak_force_N = can.peak_force_N > 0 ? can.peak_force_N : 1e-3;  // of a device without force, to measure
  hello.continuous_force_N = can.continuous_force_N;
  hello.max_stiffness_N_m = can.max_stiffness_N_m;
  hello.damping_Ns_m = can.damping_Ns_m;
  hello.resolution_m = can.resolution_m;
  hello.rate_Hz = can.nominal_rate_Hz;
  std::snprintf(hello.name, sizeof hello.name, "%s", can.name.c_str());
  return bridge;
}

bool isHeld(const std::string& device) {
  const std::string kind = device.substr(0, device.find_first_of(":,"));
  return kind == "falcon" || kind == "haply" || device == "null";
}

int run(const std::string& device, const char* address, bool zero) {
  Held held;
  held.device = filiform::makeDevice(device == "null" ? device : device + ",direct");
  held.device->open();
  int code = 0;
  if (!zero) {
    sched_param priority{};
    priority.sched_priority = 82;  // above filiform's haptic thread; a refusal only costs regularity
    sched_setscheduler(0, SCHED_FIFO, &priority);
    const bridge_device bridge = bridgeTo(held);
    code = bridge_run(&bridge, address);
    if (const char* const advice = held.device->advice(); code != 0 && *advice != 0)
      std::fprintf(stderr, "filiform-device: %s\n", advice);
  }
  held.device->close();
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  const bool zero = argc == 3 && std::strcmp(argv[1], "--zero") == 0;
  const std::string device = argc > 1 ? argv[zero ? 2 : 1] : "";
  if (argc < 2 || argc > 3 || !isHeld(device)) {
    const bool help = argc == 2 && std::strcmp(argv[1], "--help") == 0;
    std::fprintf(help ? stdout : stderr,
                 "usage: filiform-device DEVICE [PATH | udp:127.0.0.1:PORT]\n"
                 "       filiform-device --zero DEVICE\n"
                 "Hold a device that renders force and offer it as a bridge. filiform starts this program itself.\n"
                 "DEVICE: falcon[:FIRMWARE], haply[:HOST:PORT][,ID], or null to measure the transport.\n"
                 "--zero: open the device, send zero force and close it.\n");
    return help ? 0 : 2;
  }
  std::signal(SIGPIPE, SIG_IGN);  // filiform, which reads what is printed, may be dead
  try {
    return run(device, argc == 3 ? argv[2] : nullptr, zero);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "filiform-device: %s\n", error.what());
    return 3;
  }
}
