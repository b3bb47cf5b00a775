#include "device/spacemouse/spacemouse.h"

#include "device/spacemouse/internal/spacemouse_reports.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace filiform {

namespace {

constexpr std::uint16_t kLogitech = 0x046d, k3Dconnexion = 0x256f;
// Logitech sells many other devices; 3Dconnexion sells these without six axes.
constexpr std::array<std::uint16_t, 12> kLogitechMice{0xc603, 0xc605, 0xc606, 0xc621, 0xc623, 0xc625,
                                                      0xc626, 0xc627, 0xc628, 0xc629, 0xc62b, 0xc640};
constexpr std::array<std::uint16_t, 12> kOtherProducts{0xc62c, 0xc641, 0xc650, 0xc651, 0xc654, 0xc655,
                                                       0xc656, 0xc657, 0xc658, 0xc664, 0xc665, 0xc668};

constexpr std::size_t kReportBytes = 64;
constexpr int kMostRounds = 32;  // reports an exchange: a slow loop catches up, and a flood of reports cannot block it
constexpr std::uint8_t kLedReport = 4;
constexpr double kLedTimeout_s = 0.1;

// Keyboards and plain mice that share the receiver are left to the kernel.
bool isOurs(const UsbInterface& interface) {
  return interface.usb_class == 3 && !(interface.subclass == 1 && interface.protocol != 0);
}

const UsbEndpoint* endpointOf(const UsbInterface& interface, bool in) {
  for (const UsbEndpoint& endpoint : interface.endpoints)
    if (endpoint.type == UsbEndpointType::interrupt && endpoint.in() == in) return &endpoint;
  return nullptr;
}

}  // namespace

bool isSpaceMouse(const UsbDeviceInfo& info) {
  const auto in = [&info](const auto& list) { return std::find(list.begin(), list.end(), info.product) != list.end(); };
  return (info.vendor == kLogitech && in(kLogitechMice)) || (info.vendor == k3Dconnexion && !in(kOtherProducts));
}

struct SpaceMouse::Connected {
  std::unique_ptr<UsbConnection> usb;
  std::vector<UsbInterface> interfaces;
  std::vector<std::unique_ptr<UsbTransfer>> reads;  // one for each interface, always submitted
  internal::SpaceMouseState mouse;
  double opened_s = 0, moved_s = 0;
  std::uint64_t reports = 0;
};

SpaceMouse::SpaceMouse(UsbTransport& transport, const SpaceMouseOptions& options)
    : transport_(transport), options_(options) {
  for (const double value : {options.full_speed_m_s, options.full_turn_rad_s, options.silence_s})
    if (!(value > 0 && std::isfinite(value)))
      throw DeviceError("SpaceMouse: speeds and times must be finite and greater than 0");
  if (!(options.dead_zone >= 0 && options.dead_zone <= 0.9))
    throw DeviceError("SpaceMouse: the dead zone must be between 0 and 0.9 of full deflection");
  capabilities_.name = "SpaceMouse";
  capabilities_.nominal_rate_Hz = 125;
  capabilities_.buttons = 32;
  capabilities_.senses_rotation = true;
  capabilities_.rate_control = true;
}

SpaceMouse::~SpaceMouse() { close(); }

DeviceStatus SpaceMouse::status() const noexcept { return state_.status; }

std::uint64_t SpaceMouse::reports() const noexcept { return connected_ ? connected_->reports : 0; }

void SpaceMouse::open() {
  close();
  const std::vector<UsbDeviceInfo> all = transport_.devices();
  const auto found = std::find_if(all.begin(), all.end(), [this](const UsbDeviceInfo& info) {
    return isSpaceMouse(info) && (options_.bus_path.empty() || options_.bus_path == info.bus_path);
  });
  if (found == all.end())
    throw UsbError(UsbCause::not_found, "no SpaceMouse is plugged in" +
                                            (options_.bus_path.empty() ? "" : " at " + options_.bus_path) +
                                            "; filiform devices lists what is");
  auto connected = std::make_unique<Connected>();
  connected->usb = transport_.open(*found);
  for (const UsbInterface& interface : connected->usb->info().interfaces) {
    const UsbEndpoint* in = endpointOf(interface, true);
    if (!isOurs(interface) || in == nullptr) continue;
    connected->usb->claim(interface.number);
    connected->interfaces.push_back(interface);
    connected->reads.push_back(connected->usb->makeTransfer(in->address, kReportBytes));
  }
  if (connected->reads.empty())
    throw UsbError(UsbCause::failed, describe(*found) + ": no interface of a SpaceMouse found on it");
  for (const auto& read : connected->reads)
    if (!read->submit(kReportBytes))
      throw UsbError(UsbCause::gone, describe(*found) + ": it cannot be read: " + toString(read->status()));
  connected->opened_s = connected->moved_s = connected->usb->time_s();
  connected_ = std::move(connected);
  state_ = DeviceState();
  state_.sent_N = Eigen::Vector3d::Zero();
  state_.status = DeviceStatus::ready;
  light(true);
}

void SpaceMouse::close() noexcept {
  if (connected_) light(false);
  connected_.reset();
  state_ = DeviceState();
}

// A receiver does not state the interface of its mouse. So all interfaces get the command; refusals are normal.
void SpaceMouse::light(bool on) noexcept {
  std::array<std::uint8_t, 2> report{kLedReport, static_cast<std::uint8_t>(on ? 1 : 0)};
  for (const UsbInterface& interface : connected_->interfaces) {
    if (connected_->usb->gone()) return;
    try {
      if (const UsbEndpoint* out = endpointOf(interface, false)) {
        const auto write = connected_->usb->makeTransfer(out->address, report.size());
        std::copy(report.begin(), report.end(), write->buffer().begin());
        connected_->usb->run(*write, report.size(), kLedTimeout_s);
      } else {
        // HID 1.11, 7.2.2: SET_REPORT, an output report
        connected_->usb->control({0x21, 0x09, 0x0200 | kLedReport, interface.number}, report, kLedTimeout_s);
      }
    } catch (const std::exception&) {
      continue;  // the lamp is not essential
    }
  }
}

DeviceState SpaceMouse::exchange(const Wrench&) noexcept {
  if (!connected_ || state_.status != DeviceStatus::ready) return state_;
  Connected& c = *connected_;
  bool lost = false, any = true;
  for (int round = 0; round < kMostRounds && any && !lost; ++round) {
    c.usb->handleEvents(0);
    any = false;
    // Another call may have completed them too, such as the lamp request.
    for (const auto& read : c.reads) {
      if (read->pending()) continue;
      any = true;
      if (read->status() == UsbStatus::done) {
        const internal::SpaceMouseReport what = internal::takeReport(read->data(), c.mouse);
        if (what == internal::SpaceMouseReport::motion) c.moved_s = c.usb->time_s();
        if (what != internal::SpaceMouseReport::ignored) ++c.reports;
      }
      // An interface may go on after a stall or a failure, but not after `gone`.
      lost = lost || read->status() == UsbStatus::gone || !read->submit(kReportBytes);
    }
  }
  lost = lost || c.usb->gone();
  const double now_s = c.usb->time_s();
  if (now_s - c.moved_s > options_.silence_s) c.mouse.axes.fill(0);
  state_.time_s = now_s - c.opened_s;
  if (lost) {
    c.mouse = {};
    state_.status = DeviceStatus::fault;
  }
  const auto rate = [&](std::size_t axis, double full) {
    const double deflection = c.mouse.axes[axis], size = std::abs(deflection);
    if (size <= options_.dead_zone) return 0.0;
    return std::copysign(full * (size - options_.dead_zone) / (1 - options_.dead_zone), deflection);
  };
  const double v = options_.full_speed_m_s, w = options_.full_turn_rad_s;
  state_.v_D = {rate(0, v), -rate(2, v), rate(1, v)};
  state_.twist_D = {rate(3, w), -rate(5, w), rate(4, w)};
  state_.buttons = c.mouse.buttons;
  return state_;
}

}  // namespace filiform
