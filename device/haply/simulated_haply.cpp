#include "device/haply/simulated_haply.h"

#include "device/haply/internal/haply_messages.h"
#include "device/haply/internal/json_reader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

namespace filiform {

using internal::HaplyDialect;
using internal::JsonReader;

namespace {

constexpr double kMostPeriods = 5000;  // a longer gap counts as one period

std::string jsonOf(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

std::string jsonOf(bool value) { return value ? "true" : "false"; }

// `leaves_out`: without the components that are zero.
std::string vectorText(const Eigen::Vector3d& v, bool leaves_out) {
  std::string text = "{";
  for (int i = 0; i < 3; ++i) {
    if (leaves_out && v[i] == 0) continue;
    if (text.size() > 1) text += ',';
    text += std::string("\"") + "xyz"[i] + "\":" + jsonOf(v[i]);
  }
  return text + "}";
}

SimulatedHandOptions handOptions(const SimulatedHaplyOptions& options) {
  SimulatedHandOptions hand;
  hand.hand = options.hand;
  hand.period_s = options.period_s;
  hand.delay_samples = options.delay_samples;
  hand.device_damping_Ns_m = options.device_damping_Ns_m;
  return hand;
}

}  // namespace

struct SimulatedHaply::Impl {
  struct Device {
    Device(std::string name, const SimulatedHaplyOptions& options) : id(std::move(name)), hand(handOptions(options)) {}
    std::string id;
    SimulatedHand hand;
    DeviceState state;
    Eigen::Vector3d force_H = Eigen::Vector3d::Zero();  // that acts now
    std::array<Eigen::Vector3d, 8> commanded_H{};       // newest first
    std::array<Eigen::Vector3d, 3> acted_H{};           // newest first
    double given_J = 0, most_step_J = 0;
  };

  SimulatedHaplyOptions options;
  SimulatedHaplyFaults faults;
  std::vector<std::unique_ptr<Device>> devices;
  std::array<double, 4> orientation_H{1, 0, 0, 0};
  std::atomic<std::uint64_t> answers{0};
  std::atomic<double> strongest_N{0}, acting_N{0};
  double now_s = 0;
  std::optional<double> moved_s;  // the clock's time to which the hands have moved

  std::string status() const {
    if (faults.leaves_out) return "";
    return ",\"status\":{\"calibrated\":" + jsonOf(faults.calibrated.load()) +
           ",\"in_use\":false,\"power_supply\":" + jsonOf(faults.power.load()) +
           ",\"ready\":" + jsonOf(faults.ready.load()) + ",\"started\":true}";
  }

  std::string grip() const {
    if (!options.has_grip) return "\"verse_grip\":[]";
    const std::uint32_t held = faults.buttons;
    const bool leaves_out = faults.leaves_out;
    std::string text = options.is_wireless ? R"("wireless_verse_grip":[{"device_id":"61548","state":{)"
                                           : R"("verse_grip":[{"device_id":"61548","state":{)";
    if (!options.is_wireless)
      text += "\"button\":" + jsonOf((held & 1) != 0) + ",";
    else if (!leaves_out || held != 0)
      text += "\"buttons\":{\"a\":" + jsonOf((held & 1) != 0) + ",\"b\":" + jsonOf((held & 2) != 0) +
              ",\"c\":" + jsonOf((held & 4) != 0) + "},";
    text += "\"orientation\":{";
    bool first = true;
    for (std::size_t i = 0; i < 4; ++i) {
      if (leaves_out && orientation_H[i] == 0) continue;
      text += std::string(first ? "\"" : ",\"") + "wxyz"[i] + "\":" + jsonOf(orientation_H[i]);
      first = false;
    }
    return text + "}}}]";
  }

  Device* find(std::string_view id) {
    for (const auto& device : devices)
      if (device->id == id) return device.get();
    return nullptr;
  }

  // The force that a command names as this version does.
  static Eigen::Vector3d readVector(JsonReader& in) {
    Eigen::Vector3d read = Eigen::Vector3d::Zero();
    in.object([&](std::string_view axis) {
      if (axis == "x") in.number(read.x());
      if (axis == "y") in.number(read.y());
      if (axis == "z") in.number(read.z());
    });
    return read;
  }
  void command(JsonReader& in, Device*& device, std::optional<Eigen::Vector3d>& force_H) {
    const char* const wanted = toString(internal::dialectFor(options.version));
    in.object([&](std::string_view key) {
      std::string_view id;
      if (key == "device_id" && in.string(id)) device = find(id);
      if (key != "commands") return;
      in.object([&](std::string_view name) {
        if (name == "set_cursor_force")
          in.object([&](std::string_view member) {
            if (member == wanted) force_H = readVector(in);
          });
        if (name == "filiform_aim" && options.is_led)
          in.object([&](std::string_view member) {
            if (member == "position" && device != nullptr) device->hand.setTarget(readVector(in) - options.centre_H);
          });
      });
    });
  }

  template <std::size_t N>
  static void push(std::array<Eigen::Vector3d, N>& newest_first, const Eigen::Vector3d& newest) {
    std::rotate(newest_first.begin(), newest_first.end() - 1, newest_first.end());
    newest_first[0] = newest;
  }

  Eigen::Vector3d mirrored(const Eigen::Vector3d& v) const {
    return options.is_mirrored ? Eigen::Vector3d(-v.x(), v.y(), v.z()) : v;
  }

  // One period under the force that acts.
  void move(Device& device) {
    const bool is_first = &device == devices.front().get();
    if (is_first && options.target) device.hand.setTarget(options.target(moved_s.value_or(0)));
    Wrench wrench;
    wrench.force_N = mirrored(device.force_H);
    push(device.acted_H, wrench.force_N);
    const Eigen::Vector3d before_m = device.state.p_D;
    device.state = device.hand.exchange(wrench);
    const Eigen::Vector3d& acted_N = device.acted_H[static_cast<std::size_t>(options.delay_samples)];
    const Eigen::Vector3d dx_m = device.state.p_D - before_m;
    const double step_J = acted_N.dot(dx_m);
    device.given_J += step_J;
    device.most_step_J = std::max(device.most_step_J, std::abs(step_J));
    if (is_first && options.observe) options.observe({moved_s.value_or(0), acted_N, dx_m, device.state.p_D});
  }

  void pass(Device& device, const Eigen::Vector3d& commanded_H) {
    push(device.commanded_H, commanded_H);
    const bool renders = faults.calibrated && faults.ready && faults.power && !faults.ignores_force;
    device.force_H = device.commanded_H[static_cast<std::size_t>(options.command_delay)];
    if (!renders) device.force_H.setZero();
    strongest_N = std::max(strongest_N.load(), device.force_H.norm());
    if (&device == devices.front().get()) acting_N = device.force_H.norm();
    if (!options.clock) move(device);
  }

  // By the clock: until now, the last force acted.
  void catchUp() {
    if (!options.clock) return;
    const double time_s = options.clock();
    if (!moved_s || !(time_s - *moved_s < kMostPeriods * options.period_s)) moved_s = time_s - options.period_s;
    for (; *moved_s + options.period_s <= time_s; *moved_s += options.period_s)
      for (const auto& device : devices) move(*device);
  }

  std::string stateText(const Device& device) const {
    const bool leaves_out = faults.leaves_out;
    Eigen::Vector3d p_H = mirrored(options.centre_H + device.state.p_D);
    p_H.x() += faults.jump_m;
    std::string text = "{\"device_id\":\"" + device.id + "\",\"state\":{";
    if (!faults.has_no_position) text += "\"cursor_position\":" + vectorText(p_H, leaves_out) + ",";
    text += "\"cursor_velocity\":" + vectorText(mirrored(device.state.v_D), leaves_out) +
            ",\"current_cursor_force\":" + vectorText(device.force_H, leaves_out) +
            R"(,"control_domain":"cartesian","control_mode":"force","transform":{}})" + status() + "}";
    return text;
  }
};

SimulatedHaply::SimulatedHaply(const SimulatedHaplyOptions& options) : impl_(std::make_unique<Impl>()) {
  if (options.command_delay < 0 || options.command_delay > 7)
    throw DeviceError("simulated Haply: the delay of commands must be 0 to 7 messages");
  impl_->options = options;
  for (const std::string& id : options.devices) {
    impl_->devices.push_back(std::make_unique<Impl::Device>(id, options));
    impl_->devices.back()->commanded_H.fill(Eigen::Vector3d::Zero());
    impl_->devices.back()->acted_H.fill(Eigen::Vector3d::Zero());
    impl_->devices.back()->hand.open();
  }
}

SimulatedHaply::~SimulatedHaply() = default;

SimulatedHaplyFaults& SimulatedHaply::faults() noexcept { return impl_->faults; }

std::string SimulatedHaply::inventory() const {
  std::string text = "{\"session_id\":7,\"inverse3\":[";
  for (const auto& device : impl_->devices)
    text += (text.back() == '[' ? "" : ",") + std::string("{\"device_id\":\"") + device->id +
            R"(","config":{"device_info":{"major_version":0})" +
            (impl_->options.is_led ? R"(,"filiform_is_led":true)" : "") + "}" + impl_->status() + "}";
  return text + "]," + impl_->grip() + "}";
}

std::string SimulatedHaply::answer(std::string_view message) {
  Impl& d = *impl_;
  std::vector<Eigen::Vector3d> commanded_H(d.devices.size(), Eigen::Vector3d::Zero());
  JsonReader in(message);
  in.object([&](std::string_view key) {
    if (key != "inverse3") return;
    in.array([&] {
      Impl::Device* device = nullptr;
      std::optional<Eigen::Vector3d> force_H;
      d.command(in, device, force_H);
      for (std::size_t i = 0; i < d.devices.size(); ++i)
        if (d.devices[i].get() == device && force_H) commanded_H[i] = *force_H;
    });
  });
  d.catchUp();
  for (std::size_t i = 0; i < d.devices.size(); ++i) d.pass(*d.devices[i], commanded_H[i]);
  ++d.answers;
  if (d.faults.is_silent) return "";
  if (d.faults.sends_garbage) return "{\"inverse3\":[{\"device_id\":";
  std::string text = "{\"session_id\":7,\"inverse3\":[";
  for (const auto& device : d.devices) text += (text.back() == '[' ? "" : ",") + d.stateText(*device);
  return text + "]," + d.grip() + "}";
}

void SimulatedHaply::endSession() noexcept {
  impl_->acting_N = 0;
  for (const auto& device : impl_->devices) {
    device->force_H.setZero();
    device->commanded_H.fill(Eigen::Vector3d::Zero());
  }
}

Eigen::Vector3d SimulatedHaply::force_H(std::size_t index) const { return impl_->devices.at(index)->force_H; }

SimulatedHand& SimulatedHaply::hand(std::size_t index) { return impl_->devices.at(index)->hand; }

void SimulatedHaply::setOrientation(const std::array<double, 4>& orientation_H) {
  impl_->orientation_H = orientation_H;
}

double SimulatedHaply::given_J(std::size_t index) const { return impl_->devices.at(index)->given_J; }

double SimulatedHaply::most_step_J(std::size_t index) const { return impl_->devices.at(index)->most_step_J; }

const SimulatedHaplyOptions& SimulatedHaply::options() const noexcept { return impl_->options; }

std::uint64_t SimulatedHaply::answers() const noexcept { return impl_->answers; }

double SimulatedHaply::strongest_N() const noexcept { return impl_->strongest_N; }

double SimulatedHaply::acting_N() const noexcept { return impl_->acting_N; }

double& SimulatedHaply::now_s() noexcept { return impl_->now_s; }

}  // namespace filiform
