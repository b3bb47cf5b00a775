#include "device/gamepad/gamepad_port.h"

#include "device/haptic_device.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <linux/input.h>
#include <sstream>
#include <sys/ioctl.h>
#include <unistd.h>

namespace filiform {

namespace {

constexpr int kPadAxes = 6;
constexpr std::uint16_t kRumble_ms = 200;  // if no further command comes

// A bit of a mask as /sys writes it: words of 64 bits in hexadecimal, the highest first.
bool hasBit(const std::string& mask, unsigned bit) {
  std::vector<unsigned long> words;
  std::istringstream in(mask);
  for (unsigned long word = 0; in >> std::hex >> word;) words.push_back(word);
  const std::size_t at = bit / 64;
  return at < words.size() && (words[words.size() - 1 - at] >> (bit % 64) & 1) != 0;
}

std::string lineOf(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

class EvdevPort : public GamepadPort {
 public:
  explicit EvdevPort(const std::string& path) : file_(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)) {
    if (file_ < 0 && errno == EACCES) file_ = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (file_ < 0)
      throw DeviceError(path + ": cannot open the gamepad: " + std::strerror(errno) +
                        "; filiform devices lists what is plugged in");
    for (std::size_t axis = 0; axis < kPadAxes; ++axis) {
      input_absinfo info{};
      // Otherwise the usual range stays.
      if (::ioctl(file_, EVIOCGABS(axis), &info) >= 0 && info.maximum > info.minimum)
        ranges_[axis] = {static_cast<double>(info.minimum), static_cast<double>(info.maximum)};
    }
    effect_.type = FF_RUMBLE;
    effect_.id = -1;
    effect_.replay.length = kRumble_ms;
    rumbles_ = upload();
  }
  ~EvdevPort() override { ::close(file_); }  // the kernel ends the effects
  EvdevPort(const EvdevPort&) = delete;
  EvdevPort& operator=(const EvdevPort&) = delete;

  bool rumbles() const noexcept override { return rumbles_; }
  Range range(std::uint16_t axis) const noexcept override { return axis < kPadAxes ? ranges_[axis] : Range{}; }

  int read(std::span<GamepadEvent> events) noexcept override {
    std::array<input_event, 64> read{};
    const std::size_t most = std::min(events.size(), read.size());
    const ssize_t size = ::read(file_, read.data(), most * sizeof(input_event));
    if (size < 0) return errno == EAGAIN || errno == EINTR ? 0 : -1;
    if (size == 0) return -1;
    const std::size_t count = static_cast<std::size_t>(size) / sizeof(input_event);
    for (std::size_t i = 0; i < count; ++i) events[i] = {read[i].type, read[i].code, read[i].value};
    return static_cast<int>(count);
  }

  bool rumble(double strength) noexcept override {
    if (!rumbles_) return false;
    const auto magnitude = static_cast<std::uint16_t>(std::lround(65535 * std::clamp(strength, 0.0, 1.0)));
    effect_.u.rumble = {magnitude, magnitude};
    if (magnitude > 0 && !upload()) return false;
    input_event play{};
    play.type = EV_FF;
    play.code = static_cast<std::uint16_t>(effect_.id);
    play.value = magnitude > 0 ? 1 : 0;
    return ::write(file_, &play, sizeof play) == static_cast<ssize_t>(sizeof play);
  }

 private:
  // The kernel gives a new effect its number.
  bool upload() noexcept { return ::ioctl(file_, EVIOCSFF, &effect_) >= 0; }

  int file_;
  std::array<Range, kPadAxes> ranges_{};
  ff_effect effect_{};
  bool rumbles_ = false;
};

}  // namespace

std::vector<FoundGamepad> findGamepads(const std::string& sys, const std::string& dev) {
  std::vector<std::pair<int, FoundGamepad>> found;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(sys, none)) {
    const std::string node = entry.path().filename();
    if (!node.starts_with("event") || node.size() > 9 || node.find_first_not_of("0123456789", 5) != std::string::npos ||
        node.size() == 5)
      continue;
    const std::filesystem::path device = entry.path() / "device";
    // A gamepad has the button BTN_SOUTH and two axes at least: gamepad.rst.
    if (!hasBit(lineOf(device / "capabilities/key"), BTN_SOUTH)) continue;
    const std::string axes = lineOf(device / "capabilities/abs");
    if (!hasBit(axes, ABS_X) || !hasBit(axes, ABS_Y)) continue;
    FoundGamepad pad;
    pad.path = dev + "/" + node;
    pad.name = lineOf(device / "name");
    pad.rumbles = hasBit(lineOf(device / "capabilities/ff"), FF_RUMBLE);
    pad.may_open = ::access(pad.path.c_str(), R_OK | W_OK) == 0;
    found.emplace_back(std::stoi(node.substr(5)), std::move(pad));
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<FoundGamepad> pads;
  for (auto& [number, pad] : found) pads.push_back(std::move(pad));
  return pads;
}

std::unique_ptr<GamepadPort> openGamepad(const std::string& path) { return std::make_unique<EvdevPort>(path); }

}  // namespace filiform
