#include "device/gamepad/gamepad.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <linux/input-event-codes.h>
#include <utility>

namespace filiform {

namespace {

constexpr int kAxes = 6, kMostReads = 4;
constexpr std::array<std::uint16_t, 8> kButtons{BTN_SOUTH, BTN_EAST, BTN_TR,     BTN_TL,
                                                BTN_NORTH, BTN_WEST, BTN_SELECT, BTN_START};

std::string firstGamepad() {
  const std::vector<FoundGamepad> pads = findGamepads();
  const auto pad = std::find_if(pads.begin(), pads.end(), [](const FoundGamepad& one) { return one.may_open; });
  if (pad != pads.end()) return pad->path;
  if (pads.empty()) throw DeviceError("no gamepad is plugged in; filiform devices lists what is");
  throw DeviceError(pads.front().path +
                    ": no permission to open the gamepad; log in at this machine itself, or join "
                    "the group input");
}

}  // namespace

struct Gamepad::Impl {
  GamepadOptions options;
  DeviceCapabilities capabilities;
  DeviceState state;
  std::unique_ptr<GamepadPort> port;
  std::array<double, kAxes> values{};
  std::array<bool, kAxes> known{};  // the axis was reported
  std::uint32_t buttons = 0;
  bool drops = false;  // the kernel lost events: what comes until the next SYN_REPORT is not whole
  double opened_s = 0, rumbled_s = -1, strength = 0;

  double time_s() const noexcept {
    if (options.clock) return options.clock();
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }

  void take(const GamepadEvent& event) noexcept {
    if (event.type == EV_SYN) {
      if (event.code == SYN_DROPPED) {
        drops = true;
        known.fill(false);
        buttons = 0;
      } else if (event.code == SYN_REPORT) {
        drops = false;
      }
    }
    if (drops) return;
    if (event.type == EV_ABS && event.code < kAxes) {
      values[event.code] = event.value;
      known[event.code] = true;
    }
    if (event.type != EV_KEY) return;
    const auto button = std::find(kButtons.begin(), kButtons.end(), event.code);
    if (button == kButtons.end()) return;
    const std::uint32_t bit = 1U << (button - kButtons.begin());
    buttons = event.value != 0 ? buttons | bit : buttons & ~bit;
  }

  // -1 .. 1 of a stick, without the dead zone.
  double stick(std::uint16_t axis) const noexcept {
    if (!known[axis]) return 0;
    const GamepadPort::Range range = port->range(axis);
    return beyondRest(std::clamp(2 * (values[axis] - range.lo) / (range.hi - range.lo) - 1, -1.0, 1.0));
  }
  // 0 .. 1 of a trigger.
  double trigger(std::uint16_t axis) const noexcept {
    if (!known[axis]) return 0;
    const GamepadPort::Range range = port->range(axis);
    return beyondRest(std::clamp((values[axis] - range.lo) / (range.hi - range.lo), 0.0, 1.0));
  }
  double beyondRest(double part) const noexcept {
    const double size = std::abs(part), rest = options.dead_zone;
    return size <= rest ? 0 : std::copysign((size - rest) / (1 - rest), part);
  }

  // The effect of the port ends after 0.2 s: a lasting one is commanded again.
  void rumble(double wanted, double now_s) noexcept {
    if (!port->rumbles() || (wanted == 0 && strength == 0)) return;
    if (wanted > 0 && now_s - rumbled_s < kRumblePeriod_s) return;
    port->rumble(wanted);
    strength = wanted;
    rumbled_s = now_s;
  }
};

Gamepad::Gamepad(GamepadOptions options) : impl_(std::make_unique<Impl>()) {
  if (!(options.full_speed_m_s > 0 && options.full_speed_m_s <= 10) || !(options.full_turn_rad_s > 0) ||
      !(options.full_turn_rad_s <= 100) || !(options.dead_zone >= 0 && options.dead_zone < 1))
    throw DeviceError("gamepad: speeds must be greater than 0, and the dead zone 0 to 1");
  impl_->options = std::move(options);
  DeviceCapabilities& can = impl_->capabilities;
  can.name = "gamepad";
  can.buttons = static_cast<int>(kButtons.size());
  can.senses_rotation = can.rate_control = true;
}

Gamepad::~Gamepad() { close(); }

const DeviceCapabilities& Gamepad::capabilities() const { return impl_->capabilities; }

DeviceStatus Gamepad::status() const noexcept { return impl_->state.status; }

bool Gamepad::rumbles() const noexcept { return impl_->port != nullptr && impl_->port->rumbles(); }

void Gamepad::open() {
  close();
  Impl& d = *impl_;
  const std::string path = d.options.path.empty() && !d.options.connect ? firstGamepad() : d.options.path;
  d.port = d.options.connect ? d.options.connect(path) : openGamepad(path);
  d.values.fill(0);
  d.known.fill(false);
  d.buttons = 0;
  d.drops = false;
  d.strength = 0;
  d.rumbled_s = -1;
  d.opened_s = d.time_s();
  d.state = DeviceState();
  d.state.sent_N = Eigen::Vector3d::Zero();
  d.state.status = DeviceStatus::ready;
}

void Gamepad::close() noexcept {
  Impl& d = *impl_;
  if (d.port != nullptr && d.strength > 0) d.port->rumble(0);
  d.port.reset();
  d.state = DeviceState();
}

DeviceState Gamepad::exchange(const Wrench& wrench) noexcept {
  Impl& d = *impl_;
  if (d.port == nullptr || d.state.status != DeviceStatus::ready) return d.state;
  std::array<GamepadEvent, 64> events{};
  int count = 0;
  for (int i = 0; i < kMostReads && (count = d.port->read(events)) > 0; ++i)
    for (int event = 0; event < count; ++event) d.take(events[static_cast<std::size_t>(event)]);
  const double now_s = d.time_s();
  d.state.time_s = now_s - d.opened_s;
  if (count < 0) {
    d.state.status = DeviceStatus::fault;
    d.state.v_D.setZero();
    d.state.twist_D.setZero();
    d.state.buttons = 0;
    return d.state;
  }
  d.rumble(finiteOrZero(wrench).resistance, now_s);
  const double v = d.options.full_speed_m_s, w = d.options.full_turn_rad_s;
  d.state.v_D = {v * d.stick(ABS_X), -v * d.stick(ABS_Y), v * (d.trigger(ABS_Z) - d.trigger(ABS_RZ))};
  d.state.twist_D = {w * d.stick(ABS_RY), w * d.stick(ABS_RX), 0};
  d.state.buttons = d.buttons;
  return d.state;
}

}  // namespace filiform
