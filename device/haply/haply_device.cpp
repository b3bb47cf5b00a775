#include "device/haply/haply_device.h"

#include "device/device_gate.h"
#include "device/haply/internal/haply_link.h"
#include "device/haply/internal/haply_proof.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

namespace filiform {

using internal::HaplyDialect;

namespace {

constexpr double kHaplyZero_s = 0.002;    // for a zero message of a fault or of close() to be taken and answered
constexpr double kHaplyWrite_s = 0.001;   // for a message to be taken
constexpr double kHaplyReach_m = 1;       // from the mounting plate: out of the mechanism's reach
constexpr double kJumpInterval_s = 1e-3;  // of the speed check
constexpr double kReported_N = 0.1;       // a force that the states must report
constexpr int kMostDrained = 32;          // messages an exchange: a flood does not hold the caller

Eigen::Vector3d toD(const Eigen::Vector3d& v_H) noexcept { return {v_H.x(), v_H.z(), -v_H.y()}; }
Eigen::Vector3d toH(const Eigen::Vector3d& v_D) noexcept { return {v_D.x(), -v_D.z(), v_D.y()}; }

// The axis of a turn is turned as any vector; q is w, x, y, z.
Orientation toD(const std::array<double, 4>& q_H) noexcept { return {q_H[0], q_H[1], q_H[3], -q_H[2]}; }

std::string listOf(const internal::HaplyInventory& inventory) {
  std::string list;
  for (const auto& device : inventory.devices) list += (list.empty() ? "" : ", ") + device.id;
  return list;
}

}  // namespace

HaplyOptions haplyOptions(const std::string& argument) {
  const auto refuse = [&](const std::string& why) {
    return UnknownDevice(
        "device haply" + argument + ": " + why + "; write haply, haply:HOST:PORT or haply:HOST:PORT,ID",
        "haply" + argument, {"haply"});
  };
  HaplyOptions options;
  const std::size_t comma = argument.find(',');
  std::string place = argument.substr(0, comma);
  if (const char* const named = std::getenv(kHaplyServiceVariable); place.empty() && named != nullptr && *named != 0)
    place = std::string(":") + named;
  if (comma != std::string::npos) {
    options.id = argument.substr(comma + 1);
    if (options.id.empty() || options.id.size() > internal::kMostHaplyId ||
        options.id.find_first_of("\"\\,") != std::string::npos)
      throw refuse("'" + options.id + "' cannot be the id of a device");
  }
  if (place.empty()) return options;
  const std::size_t colon = place.rfind(':');
  if (place[0] != ':' || colon == 0) throw refuse("host and port are needed");
  options.host = place.substr(1, colon - 1);
  if (options.host.size() > 2 && options.host.front() == '[' && options.host.back() == ']')
    options.host = options.host.substr(1, options.host.size() - 2);
  const char* const end = place.data() + place.size();
  const auto [after, wrong] = std::from_chars(place.data() + colon + 1, end, options.port);
  if (wrong != std::errc() || after != end || options.port == 0) throw refuse("the port must be a number to 65535");
  if (options.host.empty()) throw refuse("the host has no name");
  return options;
}

double haplyStiffness(double period_s, int delay_samples) noexcept {
  return std::min(HaplyDevice::kMostStiffness_N_m,
                  HaplyDevice::kAssumedDamping_Ns_m / (period_s * (0.5 + delay_samples)));
}

struct HaplyDevice::Impl {
  HaplyOptions options;
  DeviceCapabilities capabilities;
  HaplyCounters counters;
  HaplyTransport transport;
  internal::HaplyLink link;
  internal::HaplyReading reading;
  DeviceState state;
  std::atomic<const char*> advice{""};
  HaplyDialect dialect = HaplyDialect::vector;
  internal::HaplyProof proof{kProbe_N, kProofStates};
  DeviceGate gate{kMostForce_N, options.ramp_s};
  int unreported = 0;  // states in a row that do not report the commanded force
  bool had_position = false;
  double opened_s = 0, state_s = 0, asked_s = 0, sent_s = 0;
  int unanswered = 0;   // messages whose answer is waited for
  bool awaits = false;  // no answer came since the message of asked_s
  Eigen::Vector3d sent_H = Eigen::Vector3d::Zero();
  Eigen::Vector3d aim_D = Eigen::Vector3d::Zero();  // of a simulated hand

  void say(const char* text) noexcept { advice.store(text, std::memory_order_relaxed); }

  internal::MakeStream connection() const {
    if (options.connect) return options.connect;
    return [this] { return connectTcp(options.host, options.port, {.timeout_s = options.timeout_s}); };
  }

  internal::HaplyInventory beginSession() {
    const std::string at = options.host + ':' + std::to_string(options.port);
    try {
      transport.version = internal::askService(connection(), options.host, "/version", options.timeout_s);
    } catch (const DeviceError& error) {
      throw DeviceError("the Haply Inverse Service does not run (" + at + ": " + error.what() +
                        "): start it with systemctl start haply-inverse-service, or name its host and port");
    }
    dialect = internal::dialectFor(transport.version);
    try {
      return link.open(connection(), options.host, options.timeout_s);
    } catch (const DeviceError& error) {
      throw DeviceError("no Haply Inverse Service at " + at + ": " + error.what() +
                        "; name the host and port of the service, version 3.1 or later");
    }
  }

  void choose(const internal::HaplyInventory& inventory) {
    const auto& devices = inventory.devices;
    if (devices.empty())
      throw DeviceError("no Inverse3 is connected to the Haply Inverse Service: connect its USB cable and its power");
    if (options.id.empty() && devices.size() > 1)
      throw DeviceError("several Inverse3 are connected (" + listOf(inventory) + "): name one, as in haply," +
                        devices.front().id);
    const auto chosen = std::find_if(devices.begin(), devices.end(), [this](const auto& device) {
      return options.id.empty() || device.id == options.id;
    });
    if (chosen == devices.end())
      throw DeviceError("no Inverse3 with the id " + options.id + " is connected; connected: " + listOf(inventory));
    id = chosen->id;
    capabilities.name = "Haply Inverse3 " + id;
    capabilities.is_led = chosen->is_led;
    capabilities.senses_orientation = !inventory.grips.empty();
    capabilities.buttons = inventory.buttons;
    reading = {};
    reading.status = chosen->status;
  }
  std::string id;

  // The time of exchanges without force, which also brings the first states.
  void measure() {
    std::vector<double> periods_s;
    periods_s.reserve(kMeasured);
    const double until_s = link.time_s() + options.timeout_s;
    double last_s = link.time_s();
    for (int i = 0; i < kMeasured && link.time_s() < until_s && link.isOpen(); ++i) {
      trade(Eigen::Vector3d::Zero(), link.time_s() + kAnswerTime_s);
      const double now_s = link.time_s();
      if (unanswered == 0) periods_s.push_back(now_s - last_s);
      last_s = now_s;
    }
    if (!link.isOpen()) throw DeviceError("the Haply Inverse Service has ended the connection: start it again");
    if (periods_s.empty() || counters.states == 0)
      throw DeviceError("the Haply Inverse Service sends no state of " + capabilities.name +
                        ": restart the service and the device");
    std::sort(periods_s.begin(), periods_s.end());
    transport.period_s = std::max(periods_s[periods_s.size() / 2], 1 / options.most_rate_Hz);
    transport.slow_period_s = std::max(periods_s[periods_s.size() * 9 / 10], 1 / options.most_rate_Hz);
    limit();
    capabilities.nominal_rate_Hz = 1 / transport.period_s;
  }

  void limit() {
    capabilities.delay_samples = 1 + transport.delay_states;
    transport.stiffness_N_m = haplyStiffness(transport.slow_period_s, capabilities.delay_samples);
    capabilities.max_stiffness_N_m = transport.stiffness_N_m;
    if (transport.stiffness_N_m < kLeastStiffness_N_m)
      throw DeviceError("the Haply Inverse Service answers too slowly for a stable force, " +
                        std::to_string(std::lround(1 / transport.slow_period_s)) +
                        " times a second: run it on this machine, and close other programs");
  }

  // As far as the device is ready: otherwise exchange() goes on with it.
  void prove() {
    const double until_s = link.time_s() + options.timeout_s;
    while (!proof.isProven() && state.status == DeviceStatus::homing && link.time_s() < until_s) {
      step();
      if (proof.isWaiting() && reading.has_device) break;
    }
    if (state.status == DeviceStatus::fault) throw DeviceError(advice.load());
    limit();
  }

  // Sends a force, or zero if the last messages are not answered, and takes the answers that come until the deadline.
  // Returns whether a state of the device came.
  bool trade(const Eigen::Vector3d& force_H, double deadline_s) noexcept {
    double now_s = link.time_s();
    const double due_s = sent_s + 1 / options.most_rate_Hz;
    if (now_s < due_s) {
      link.sleepUntil(due_s);
      now_s = link.time_s();
    }
    bool has_state = drain(now_s);  // what came late, or unasked, is not the answer to the next message
    // Stop waiting for an answer that does not come. Otherwise no further message would be sent.
    if (unanswered > 0 && now_s - sent_s > kStale_s) unanswered = 0;
    if (unanswered == 0) send(force_H);
    while (unanswered > 0 && link.isOpen()) {
      const std::string_view message = link.receive(deadline_s);
      if (message.empty()) break;
      has_state = take(message) || has_state;
    }
    if (unanswered > 0) ++counters.unanswered;
    return has_state;
  }

  bool drain(double until_s) noexcept {
    bool has_state = false;
    for (int i = 0; i < kMostDrained && link.isOpen(); ++i) {
      const std::string_view message = link.receive(until_s);
      if (message.empty()) break;
      has_state = take(message) || has_state;
    }
    return has_state;
  }

  bool send(const Eigen::Vector3d& force_H) noexcept {
    sent_s = link.time_s();
    const Eigen::Vector3d aim_H = options.centre_H + toH(aim_D);
    if (!link.send({id, dialect, force_H, capabilities.is_led ? &aim_H : nullptr}, kHaplyWrite_s)) return false;
    if (!awaits) asked_s = sent_s;
    awaits = true;
    ++counters.messages;
    ++unanswered;
    sent_H = force_H;
    return true;
  }

  bool take(std::string_view message) noexcept {
    unanswered = std::max(0, unanswered - 1);
    awaits = false;
    if (!internal::readState(message, id, reading) || !reading.has_device) {
      ++counters.unreadable;
      return false;
    }
    ++counters.states;
    state.buttons = reading.buttons;
    if (reading.has_orientation && capabilities.senses_orientation) state.orientation_D = toD(reading.orientation_H);
    if (!reading.has_position || !(reading.position_H.cwiseAbs().maxCoeff() <= kHaplyReach_m)) return true;
    const double now_s = link.time_s();
    const Eigen::Vector3d p_D = toD(reading.position_H - options.centre_H);
    if (had_position && (p_D - state.p_D).norm() > kMostSpeed_m_s * std::max(now_s - state_s, kJumpInterval_s)) {
      ++counters.jumps;
      gate.close(now_s);
    }
    had_position = true;
    state_s = now_s;
    state.time_s = now_s - opened_s;
    state.p_D = p_D;
    state.v_D = toD(reading.velocity_H);
    if (!(state.v_D.cwiseAbs().maxCoeff() <= 1e3)) state.v_D.setZero();
    return true;
  }

  // One exchange before the force is proven.
  void step() noexcept {
    const bool has_state = trade({0, 0, proof.force_N()}, link.time_s() + kAnswerTime_s);
    if (!check() || !has_state) return;
    const char* const obstacle = internal::obstacleOf(reading.status);
    if (*obstacle != '\0' || !had_position) {
      say(*obstacle != '\0' ? obstacle : "the Inverse3 reports no position: switch it off and on");
      proof.wait();
      return;
    }
    using Found = internal::HaplyProof::Found;
    switch (proof.take(reading.force_H.z())) {
      case Found::nothing:
        break;
      case Found::begun:
        say("the driver tests the device's force: let the handle rest");
        break;
      case Found::other_name:
        dialect = dialect == HaplyDialect::vector ? HaplyDialect::values : HaplyDialect::vector;
        break;
      case Found::failed:
        say("the Inverse3 does not report the force that it is sent: update the Haply Inverse Service, and close other "
            "programs that use the device");
        fail();
        break;
      case Found::proven:
        transport.delay_states = proof.delay_states();
        transport.dialect = toString(dialect);
        unreported = 0;
        gate.close(link.time_s());
        state.status = DeviceStatus::ready;
        say("");
        break;
    }
  }

  // False if the session is over.
  bool check() noexcept {
    if (!link.isOpen()) {
      say("the Haply Inverse Service has ended the connection: look whether it runs, and whether the device is "
          "connected");
      fail();
    } else if (awaits && link.time_s() - asked_s > kLost_s) {
      say("the Haply Inverse Service does not answer: restart it");
      fail();
    }
    return state.status != DeviceStatus::fault;
  }

  void sendZeros(double until_s) noexcept {
    for (int i = 0; i < kZeroMessages && link.isOpen(); ++i) {
      if (i > 0 && link.time_s() >= until_s) break;
      if (!send(Eigen::Vector3d::Zero())) break;
      while (unanswered > 0 && link.isOpen()) {
        const std::string_view message = link.receive(until_s);
        if (message.empty()) break;
        take(message);
      }
    }
  }

  void fail() noexcept {
    if (state.status == DeviceStatus::fault) return;
    state.status = DeviceStatus::fault;
    state.v_D.setZero();
    sendZeros(link.isOpen() ? link.time_s() + kHaplyZero_s : 0);
    state.sent_N = toD(sent_H);
  }

  void render(const Wrench& wrench) noexcept {
    const double now_s = link.time_s();
    const Eigen::Vector3d force_H = toH(gate.pass(wrench, now_s, state_s).force_N);
    const bool has_state = trade(force_H, now_s + kAnswerTime_s);
    if (!check() || !has_state) return;
    if (*internal::obstacleOf(reading.status) != '\0') {
      stop();
      return;
    }
    const bool is_reported = sent_H.norm() < kReported_N || reading.force_H.norm() >= 0.1 * sent_H.norm();
    unreported = is_reported ? 0 : unreported + 1;
    if (unreported >= kUnproven) stop();
  }

  // No force until the device is ready and has proven its force again.
  void stop() noexcept {
    state.status = DeviceStatus::homing;
    proof.restart();
    unreported = 0;
    const char* const obstacle = internal::obstacleOf(reading.status);
    say(*obstacle != '\0' ? obstacle : "the Inverse3 no longer reports the force that it is sent");
    sendZeros(link.time_s() + kHaplyZero_s);
    check();
  }
};

HaplyDevice::HaplyDevice(HaplyOptions options) : impl_(std::make_unique<Impl>()) {
  for (const double value : {options.ramp_s, options.most_rate_Hz, options.timeout_s})
    if (!(value > 0 && std::isfinite(value)))
      throw DeviceError("Haply: times and rates must be finite and greater than 0");
  if (options.id.size() > internal::kMostHaplyId || !options.centre_H.allFinite())
    throw DeviceError("Haply: the id is too long, or the centre is not finite");
  impl_->options = std::move(options);
  DeviceCapabilities& can = impl_->capabilities;
  can.name = "Haply Inverse3";
  can.peak_force_N = kMostForce_N;
  can.resolution_m = 0;
  can.delay_samples = 1;
  can.buttons = 3;
  can.needs_homing = true;
  can.paces_loop = true;
}

HaplyDevice::~HaplyDevice() { close(); }

void HaplyDevice::open() {
  close();
  Impl& d = *impl_;
  d.counters = {};
  d.transport = {};
  d.state = {};
  d.state.sent_N = Eigen::Vector3d::Zero();
  d.had_position = false;
  d.unanswered = d.unreported = 0;
  d.proof.reset();
  d.gate = DeviceGate(kMostForce_N, d.options.ramp_s);
  d.awaits = false;
  d.sent_H.setZero();
  try {
    d.choose(d.beginSession());
    d.opened_s = d.state_s = d.asked_s = d.link.time_s();
    d.sent_s = d.opened_s - 1;
    d.state.status = DeviceStatus::homing;
    d.measure();
    d.prove();
  } catch (...) {
    close();
    throw;
  }
}

void HaplyDevice::close() noexcept {
  Impl& d = *impl_;
  if (d.link.isOpen()) d.sendZeros(d.link.time_s() + kZeroMessages * kHaplyZero_s);
  d.link.close();
  d.state.status = DeviceStatus::closed;
  d.state.v_D.setZero();
  d.sent_H.setZero();
  d.say("");
}

const DeviceCapabilities& HaplyDevice::capabilities() const { return impl_->capabilities; }

DeviceStatus HaplyDevice::status() const noexcept { return impl_->state.status; }

void HaplyDevice::lead(const Eigen::Vector3d& target_D) noexcept {
  if (target_D.allFinite() && target_D.cwiseAbs().maxCoeff() <= kHaplyReach_m) impl_->aim_D = target_D;
}

const char* HaplyDevice::advice() const noexcept { return impl_->advice.load(std::memory_order_relaxed); }

const HaplyCounters& HaplyDevice::counters() const noexcept { return impl_->counters; }

const HaplyTransport& HaplyDevice::transport() const noexcept { return impl_->transport; }

DeviceState HaplyDevice::exchange(const Wrench& wrench) noexcept {
  Impl& d = *impl_;
  if (d.state.status != DeviceStatus::ready && d.state.status != DeviceStatus::homing) return d.state;
  if (d.proof.isProven())
    d.render(wrench);
  else
    d.step();
  d.state.sent_N = toD(d.sent_H);
  return d.state;
}

}  // namespace filiform
