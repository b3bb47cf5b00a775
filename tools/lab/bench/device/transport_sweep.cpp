#include "tools/lab/bench/device/transport_sweep.h"

#include "device/bridge/bridge_device.h"
#include "device/factory/device_factory.h"
#include "device/force_ramp.h"
#include "device/haply/haply_device.h"
#include "device/haply/simulated_haply_server.h"
#include "solver/force/force_law.h"
#include "solver/force/spring_model.h"
#include "tools/bridges/bridge.h"
#include "tools/lab/bench/bench_process.h"
#include "tools/lab/bench/device/energy_meter.h"
#include "tools/lab/bench/device/opened_bridge.h"

#include <arpa/inet.h>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <netinet/in.h>
#include <new>
#include <optional>
#include <random>
#include <stdexcept>
#include <sys/mman.h>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

namespace filiform::tools {

namespace {

using Eigen::Vector3d;
using Clock = std::chrono::steady_clock;

constexpr double kHandReach_m = 0.03, kHandSwing_Hz = 1.3;              // of the person's hand
constexpr double kMass_kg = 0.15, kDamping_Ns_m = 0.5, kPull_N_m = 60;  // vibrates where it can
constexpr double kStep_s = 1e-4;                                        // of its integration
constexpr double kRest_s = 1.5;
constexpr double kMost_N = 8;
constexpr int kMostLosses = 100;
constexpr double kStalls_per_s = 976.0 / 600, kShortest_s = 0.012, kLongest_s = 0.045;

double inSeconds(Clock::duration time) { return std::chrono::duration<double>(time).count(); }

// The hand waits at the origin, where the spring is slack, until the ramps are over. A spring that starts extended
// holds energy that the hand did not put into it, and the passivity controller then withholds the force.
Vector3d targetAt(double time_s) {
  const double angle = 2 * M_PI * kHandSwing_Hz * time_s;
  const double part = std::clamp((time_s - kRest_s) / (EnergyMeter::kBegin_s - kRest_s), 0.0, 1.0);
  return part *
         Vector3d{kHandReach_m * std::sin(angle), kHandReach_m * std::sin(0.7 * angle), kHandReach_m * std::cos(angle)};
}

// A simulated hand at the far end of a bridge. A force is constant for a step, so f . dx is exact.
struct FarHand {
  explicit FarHand(EnergyMeter& to) : meter(to) {}
  EnergyMeter& meter;
  Vector3d p_D = Vector3d::Zero(), v_D = Vector3d::Zero(), force_N = Vector3d::Zero();
  std::int64_t begin_ns = bridge_now_ns(), time_ns = begin_ns;

  int read(fb_state* state) {
    const std::int64_t now_ns = bridge_now_ns();
    for (double left_s = 1e-9 * static_cast<double>(now_ns - time_ns); left_s > 0; left_s -= kStep_s) {
      const double dt_s = std::min(left_s, kStep_s);
      const double at_s = 1e-9 * static_cast<double>(now_ns - begin_ns) - left_s + dt_s;
      v_D += dt_s * (force_N + kPull_N_m * (targetAt(at_s) - p_D) - kDamping_Ns_m * v_D) / kMass_kg;
      const Vector3d dx_D = dt_s * v_D;
      p_D += dx_D;
      meter.step(at_s, force_N, dx_D, p_D);
    }
    time_ns = now_ns;
    std::copy_n(p_D.data(), 3, state->p_D);
    std::copy_n(v_D.data(), 3, state->v_D);
    return 1;
  }
};

int readFarHand(void* self, fb_state* state) { return static_cast<FarHand*>(self)->read(state); }
int writeFarHand(void* self, const double* force_N) {
  std::copy_n(force_N, 3, static_cast<FarHand*>(self)->force_N.data());
  return 1;
}

void serveFarHand(const std::string& address, EnergyMeter& meter) {
  if (std::freopen("/dev/null", "w", stdout) == nullptr) return;
  FarHand hand(meter);
  bridge_device device{};
  device.self = &hand;
  device.read = readFarHand;
  device.write = writeFarHand;
  device.hello.flags = FB_KNOWS_VELOCITY;
  for (int i = 0; i < 3; ++i) device.hello.lo_D[i] = -(device.hello.hi_D[i] = 0.06);
  device.hello.peak_force_N = kMost_N;
  device.hello.rate_Hz = 4000;
  std::strcpy(device.hello.name, "sweep");
  bridge_run(&device, address.c_str());
}

// Memory that a forked process shares.
class SharedMeter {
 public:
  explicit SharedMeter(const EnergyMeter& begin) {
    void* const memory =
        ::mmap(nullptr, sizeof(EnergyMeter), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::runtime_error("sweep: no memory to share");
    meter_ = new (memory) EnergyMeter(begin);
  }
  ~SharedMeter() { ::munmap(meter_, sizeof(EnergyMeter)); }
  SharedMeter(const SharedMeter&) = delete;
  SharedMeter& operator=(const SharedMeter&) = delete;
  EnergyMeter& operator*() { return *meter_; }

 private:
  EnergyMeter* meter_;
};

std::string freeUdpAddress() {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool bound = ::bind(socket, reinterpret_cast<const sockaddr*>(&at), size) == 0 &&
                     ::getsockname(socket, reinterpret_cast<sockaddr*>(&at), &size) == 0;
  ::close(socket);
  if (!bound) throw std::runtime_error("sweep: no port is free");
  return "udp:127.0.0.1:" + std::to_string(ntohs(at.sin_port));
}

// The time on fades and ramps that a pause (s) of the commands causes, by the rules of device/BRIDGE.md.
double rampedAfter(double pause_s) {
  constexpr double kLive_s = 0.02, kFade_s = 0.05, kStart_s = 0.5;
  static_assert(FB_TTL_US == 20000 && FB_FADE_MS == 50 && FB_RESUME_MS == 50 && FB_START_MS == 500);
  const double faded_s = std::max(0.0, pause_s - kLive_s);
  return faded_s < kFade_s ? 2 * faded_s : faded_s + kStart_s;
}

// The loop of filiform's side: law, controller and model, once a period.
void travelFor(HapticDevice& device, SweepCell& cell, double for_s, const std::function<bool()>& stop,
               const PassivityOptions& passivity) {
  ForceLawOptions options;
  options.stiffness_N_m = cell.stiffness_N_m;
  options.max_force_N = kMost_N;
  options.passivity = passivity;
  ForceLaw law(options);
  SpringModel spring;
  Wrench wrench;
  DeviceState state = device.exchange(wrench);
  double last_s = state.time_s;
  const Clock::time_point begin = Clock::now();
  Clock::time_point due = begin, heard = begin;
  std::mt19937_64 random(1);
  std::exponential_distribution<double> between_s(kStalls_per_s);
  std::uniform_real_distribution<double> long_s(kShortest_s, kLongest_s);
  double stall_s = cell.stalls ? EnergyMeter::kBegin_s + between_s(random) : for_s;
  while (inSeconds(Clock::now() - begin) < for_s && !(stop && stop())) {
    due += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(cell.period_s));
    std::this_thread::sleep_until(due);
    if (inSeconds(Clock::now() - begin) > stall_s) {
      std::this_thread::sleep_for(std::chrono::duration<double>(long_s(random)));
      stall_s += between_s(random);
    }
    due = std::max(due, Clock::now() - std::chrono::milliseconds(1));  // late ticks are skipped
    state = device.exchange(wrench);
    if (state.status == DeviceStatus::fault) {
      if (++cell.losses >= kMostLosses) throw std::runtime_error(std::string("sweep: lost: ") + device.advice());
      law.release();
      wrench = {};
      device.open();
      cell.longest_gap_s = std::max(cell.longest_gap_s, inSeconds(Clock::now() - heard));
      last_s = 0;  // the device's time begins again
      continue;
    }
    ++cell.exchanges;
    const double dt_s = state.time_s - last_s;
    last_s = state.time_s;
    if (dt_s != 0) heard = Clock::now();
    cell.longest_gap_s = std::max(cell.longest_gap_s, dt_s);
    cell.unanswered += dt_s == 0;
    if (device.capabilities().renders_model) cell.ramped_s += rampedAfter(dt_s);
    wrench = {};
    if (state.status != DeviceStatus::ready) {
      law.release();
      continue;
    }
    if (state.sent_N) law.acted(*state.sent_N);
    wrench.force_N = law.apply(Vector3d::Zero(), state.p_D, state.v_D, dt_s);
    if (device.capabilities().renders_model && !law.fading())
      wrench.model = spring.about(state.p_D, -state.p_D, wrench.force_N, cell.stiffness_N_m, Vector3d::Zero());
  }
}

void judge(SweepCell& cell, const EnergyMeter& meter, const PassivityOptions& passivity) {
  const double step_m = meter.longestWay_m(cell.longest_gap_s + cell.period_s);
  cell.strongest_N = meter.strongest_N();
  cell.given_J = meter.given_most_J();
  cell.beyond_J =
      std::max(0.0, meter.excess_J() - passivity.energy_J - (passivity.delay_samples + 1) * cell.strongest_N * step_m);
  if (meter.steps() == 0) throw std::runtime_error("sweep: nothing was measured");
}

PassivityOptions passivityOf(const DeviceCapabilities& can) {
  PassivityOptions passivity;
  passivity.on = true;
  passivity.delay_samples = can.delay_samples;
  return passivity;
}

void runBridgeCell(SweepCell& cell, double for_s, const std::string& folder, const std::function<bool()>& stop) {
  const std::string address = cell.transport == SweepTransport::udp ? freeUdpAddress() : folder + "/sweep";
  const std::string cookie = folder + "/cookie";
  ::setenv("FILIFORM_BRIDGE_COOKIE", cookie.c_str(), 1);
  SharedMeter meter(EnergyMeter(cell.stiffness_N_m, kMost_N, PassivityOptions().power_W));
  std::optional<BenchProcess> bridge(std::in_place, [&] { serveFarHand(address, *meter); });
  const std::unique_ptr<BridgeDevice> device =
      openedBridge({.address = address, .cookie_file = cookie, .period_s = cell.period_s, .silence_s = 10});
  ::unsetenv("FILIFORM_BRIDGE_COOKIE");
  const PassivityOptions passivity = passivityOf(device->capabilities());
  travelFor(*device, cell, for_s, stop, passivity);
  device->close();
  bridge->signal(SIGSTOP);  // its meter stands still
  judge(cell, *meter, passivity);
}

void runHaplyCell(SweepCell& cell, double for_s, const std::function<bool()>& stop) {
  EnergyMeter meter(cell.stiffness_N_m, kMost_N, PassivityOptions().power_W);
  SimulatedHaplyOptions simulated;
  simulated.hand = {.mass_kg = kMass_kg, .damping_Ns_m = kDamping_Ns_m, .stiffness_N_m = kPull_N_m};
  simulated.device_damping_Ns_m = 0;
  simulated.period_s = kStep_s;
  simulated.clock = [begin = Clock::now()] { return inSeconds(Clock::now() - begin); };
  simulated.target = targetAt;
  simulated.observe = [&meter](const SimulatedHaplyStep& step) {
    meter.step(step.time_s, step.force_N, step.dx_m, step.p_m);
  };
  SimulatedHaply service(simulated);
  std::optional<SimulatedHaplyServer> server(std::in_place, service);
  std::unique_ptr<HapticDevice> haply;
  if (cell.transport == SweepTransport::process) {
    haply = makeDevice("haply:127.0.0.1:" + std::to_string(server->port()), {.period_s = cell.period_s});
  } else {
    HaplyOptions options;
    options.port = server->port();
    options.most_rate_Hz = 1 / cell.period_s;
    haply = std::make_unique<HaplyDevice>(options);
  }
  haply->open();
  for (int i = 0; i < 20'000 && haply->status() != DeviceStatus::ready; ++i) haply->exchange({});
  if (haply->status() != DeviceStatus::ready)
    throw std::runtime_error(std::string("sweep: not ready: ") + haply->advice());
  const PassivityOptions passivity = passivityOf(haply->capabilities());
  travelFor(*haply, cell, for_s, stop, passivity);
  haply->close();
  server.reset();  // its thread has ended
  judge(cell, meter, passivity);
}

}  // namespace

const char* toString(SweepTransport transport) {
  constexpr const char* kNames[] = {"seqpacket", "UDP", "Haply", "Haply, process"};
  return kNames[static_cast<int>(transport)];
}

void runSweepCell(SweepCell& cell, double for_s, const std::string& folder, const std::function<bool()>& stop) {
  const double whole_s = for_s + EnergyMeter::kBegin_s;
  if (cell.transport == SweepTransport::haply || cell.transport == SweepTransport::process)
    runHaplyCell(cell, whole_s, stop);
  else
    runBridgeCell(cell, whole_s, folder, stop);
}

}  // namespace filiform::tools
