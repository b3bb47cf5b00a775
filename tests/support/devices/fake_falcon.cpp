#include "tests/support/devices/fake_falcon.h"

#include <algorithm>
#include <stdexcept>

#include <Eigen/LU>

namespace filiform::test {
namespace {

constexpr std::uint8_t kIn = 0x81;
constexpr double kLoadingDelay_s = 0.016, kStatusDelay_s = 1e-3;
constexpr std::int16_t kCountsBeforeHoming = 4321;

std::int16_t numberAt(std::span<const std::uint8_t> packet, std::size_t at) {
  int value = 0;
  for (std::size_t k = 0; k < 4; ++k) value |= (packet[at + k] - 'A') << (4 * k);
  return static_cast<std::int16_t>(value);
}

}  // namespace

FakeFalcon::FakeFalcon(FakeUsb& usb, const std::string& bus_path)
    : device_(usb.plug(fakeBulkDevice(0x0403, 0xcb48, bus_path, "FALCON HAPTIC"))) {
  device_.on_control = [this](const UsbSetup& setup, std::span<std::uint8_t> data, FakeUsbDevice&) {
    onControl(setup);
    return std::optional(data.size());
  };
  device_.on_write = [this](std::uint8_t, std::span<const std::uint8_t> bytes, FakeUsbDevice&) { onWrite(bytes); };
  device_.on_read = [this](std::uint8_t, FakeUsbDevice&) {
    if (sends_status) answer({}, kStatusDelay_s);
  };
}

void FakeFalcon::powerUp(bool with_firmware) {
  running = with_firmware;
  image.clear();
  homed_ = homing_seen_ = loading_ = false;
}

void FakeFalcon::home() {
  if (!homing_seen_) throw std::logic_error("the driver has not asked for homing");
  homed_ = true;
}

Eigen::Vector3d FakeFalcon::force_N(double motor_per_Nm) const {
  const std::array<std::int16_t, 3>& motors = last().motors;
  const Eigen::Vector3d torques_Nm = -Eigen::Vector3d(motors[0], motors[1], motors[2]) / motor_per_Nm;
  return falconJacobian(kFalconCentre_F + p_D).value().transpose() * torques_Nm;
}

std::size_t FakeFalcon::forces_before_homing() const {
  return static_cast<std::size_t>(std::count_if(
      received_.begin(), received_.end(), [](const Received& command) { return !command.homed && !command.isZero(); }));
}

void FakeFalcon::answer(std::span<const std::uint8_t> payload, double delay_s) {
  std::vector<std::uint8_t> packet{0x01, 0x60};
  packet.insert(packet.end(), payload.begin(), payload.end());
  device_.answer(kIn, packet, delay_s);
}

void FakeFalcon::onControl(const UsbSetup& setup) {
  const FtdiRequest request{setup.request, setup.value};
  if (setup.request_type != 0x40) throw std::logic_error("a request of the wrong type");
  if (request == ftdi::kPurgeIn) device_.purge();
  if (setup.request != ftdi::kBaud9600.request) return;
  baud_ = setup.value;
  stream_.clear();
  if (request == ftdi::kBaud9600) {
    loading_ = running = false;
    image.clear();
  }
  if (request == ftdi::kBaud1500k && image.size() >= image_bytes) running = true;
}

void FakeFalcon::onWrite(std::span<const std::uint8_t> bytes) {
  if (baud_ == ftdi::kBaud1500k.value) return run(bytes);
  if (running) return;
  if (baud_ == ftdi::kBaud9600.value) {
    const std::array<std::uint8_t, 3> greeting{0x0a, 0x43, 0x0d};
    const std::array<std::uint8_t, 4> greeted{0x0a, 0x44, 0x2c, 0x0d};
    if (std::equal(bytes.begin(), bytes.end(), greeting.begin(), greeting.end())) answer(greeted, kLoadingDelay_s);
    return;
  }
  if (!loading_) {
    if (bytes.size() != 1 || bytes[0] != 0x41) return;
    loading_ = true;
    ++attempts_;
    return answer(bytes, kLoadingDelay_s);
  }
  std::vector<std::uint8_t> echo(bytes.begin(), bytes.end());
  if (wrong_echo && attempts_ <= bad_attempts && *wrong_echo >= image.size() &&
      *wrong_echo < image.size() + echo.size())
    echo[*wrong_echo - image.size()] ^= 0x55;
  image.insert(image.end(), bytes.begin(), bytes.end());
  answer(echo, kLoadingDelay_s);
}

void FakeFalcon::run(std::span<const std::uint8_t> bytes) {
  if (!running || mute) return;
  stream_.insert(stream_.end(), bytes.begin(), bytes.end());
  while (!stream_.empty()) {
    if (stream_.front() != '<') {
      stream_.erase(stream_.begin());
      continue;
    }
    if (stream_.size() < kFalconPacketBytes) return;
    const int bits = stream_[13] - 'A';
    Received command;
    command.time_s = device_.time_s();
    for (std::size_t i = 0; i < 3; ++i) command.motors[i] = numberAt(stream_, 1 + 4 * i);
    command.homing = bits & 1;
    command.green = bits & 2;
    command.blue = bits & 4;
    command.red = bits & 8;
    command.homed = homed_;
    if (stream_[15] != '>' || bits < 0 || bits > 15) throw std::logic_error("a command that is not well-formed");
    homing_seen_ = homing_seen_ || command.homing;
    received_.push_back(command);
    stream_.erase(stream_.begin(), stream_.begin() + kFalconPacketBytes);
    report();
  }
}

void FakeFalcon::report() {
  std::array<std::int16_t, 3> now{};
  if (counts) {
    now = *counts;
  } else if (const auto angles = falconAngles(kFalconCentre_F + p_D)) {
    now = falconCountsOfAngles(*angles);
  }
  if (!homed_)
    for (std::int16_t& count : now) count = static_cast<std::int16_t>(count + kCountsBeforeHoming);
  FalconPacket packet;
  packet.front() = '<';
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 4; ++k)
      packet[1 + 4 * i + k] = static_cast<std::uint8_t>('A' + ((static_cast<std::uint16_t>(now[i]) >> (4 * k)) & 15));
  packet[13] = static_cast<std::uint8_t>('A' + buttons + (homed_ ? 0x70 : 0));
  packet[14] = 'A';
  packet.back() = '>';
  answer(packet, report_delay_s);
}

}  // namespace filiform::test
