#include "device/haply/haply_device.h"
#include "device/haply/internal/haply_messages.h"
#include "device/haply/internal/json_reader.h"
#include "device/web_socket/frames.h"
#include "device/web_socket/handshake.h"
#include "tests/fuzz/fuzz_bytes.h"
#include "tests/fuzz/fuzzers.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

namespace filiform::fuzz {

namespace {

// A service that answers each message with the next frames of the input, whatever they are.
class HostileService : public ByteStream {
 public:
  explicit HostileService(Taker& frames) : frames_(frames) {}

  bool write(std::span<const char> bytes, double) noexcept override {
    const std::string_view text(bytes.data(), bytes.size());
    constexpr std::string_view kKey = "Sec-WebSocket-Key: ";
    if (text.starts_with("GET /version")) {
      coming_ = "HTTP/1.1 200 OK\r\n\r\n3.5";
    } else if (const std::size_t at = text.find(kKey); at != std::string_view::npos) {
      coming_ = "HTTP/1.1 101 Switching Protocols\r\nSec-WebSocket-Accept: " +
                internal::acceptOf(text.substr(at + kKey.size(), 24)) + "\r\n\r\n";
      put(R"({"inverse3":[{"device_id":"A"}]})");
    } else if (frames_.empty()) {
      return false;
    } else if (const auto kind = frames_.number<std::uint8_t>(); kind % 4 == 0) {
      const Input raw = frames_.some(frames_.number<std::uint8_t>());
      coming_.append(raw.begin(), raw.end());
    } else if (kind % 4 == 1) {
      const double force_N = kind % 8 == 1 ? HaplyDevice::kProbe_N : 0;
      put(R"({"inverse3":[{"device_id":"A","state":{"cursor_position":{"y":-0.12,"z":0.15},"current_cursor_force":{"z":)" +
          std::to_string(force_N) + "}}}]}");
    } else {
      const Input text_of = frames_.some(frames_.number<std::uint8_t>());
      put(std::string(text_of.begin(), text_of.end()));
    }
    return true;
  }
  long read(std::span<char> into, double wait_s) noexcept override {
    if (coming_.empty()) {
      if (frames_.empty()) return -1;
      now_s_ += wait_s;
      return 0;
    }
    const std::size_t part = std::min(into.size(), coming_.size());
    std::copy_n(coming_.begin(), part, into.begin());
    coming_.erase(0, part);
    now_s_ += 1e-4;
    return static_cast<long>(part);
  }
  void sleepUntil(double until_s) noexcept override { now_s_ = std::max(now_s_, until_s); }
  double time_s() const noexcept override { return now_s_; }

 private:
  void put(const std::string& text) {
    std::string buffer(kMostFrameHeader, ' ');
    buffer += text;
    const auto frame = frameAround(buffer, text.size(), FrameKind::text, nullptr);
    coming_.append(frame.begin(), frame.end());
  }

  Taker& frames_;
  std::string coming_;
  double now_s_ = 0;
};

}  // namespace

// States as texts, frames, and a service that sends both.
void fuzzHaply(Input input) {
  const std::string_view text(reinterpret_cast<const char*>(input.data()), input.size());
  internal::HaplyReading reading;
  internal::readState(text, "A", reading);
  require(reading.position_H.allFinite() && reading.velocity_H.allFinite() && reading.force_H.allFinite(),
          "what a state says is finite");
  double square = 0;
  for (const double part : reading.orientation_H) square += part * part;
  require(std::abs(square - 1) < 1e-9, "an orientation has length 1");
  internal::HaplyInventory inventory;
  internal::readInventory(text, inventory);
  for (const auto& device : inventory.devices) require(device.id.size() <= internal::kMostHaplyId, "ids are short");

  for (const bool masked : {false, true}) {
    FrameParser parser(300, masked);
    std::size_t at = 0;
    bool broken = false;
    while (at < text.size() && !broken) {
      const std::span<char> space = parser.space();
      require(!space.empty(), "there is space unless the parser is broken");
      const std::size_t part = std::min(space.size(), text.size() - at);
      std::copy_n(text.begin() + static_cast<std::ptrdiff_t>(at), part, space.begin());
      parser.wrote(part);
      at += part;
      std::string_view payload;
      for (;;) {
        const FrameParser::Event event = parser.next(payload);
        broken = event == FrameParser::Event::broken;
        if (broken || event == FrameParser::Event::none) break;
        require(payload.size() <= 300, "no message is longer than the capacity");
      }
    }
  }

  Taker frames(input);
  HaplyOptions options;
  options.timeout_s = 0.1;
  options.connect = [&frames] { return std::make_unique<HostileService>(frames); };
  HaplyDevice haply(options);
  try {
    haply.open();
  } catch (const DeviceError&) {
    return;
  }
  Wrench wrench;
  wrench.force_N = {3, 4, 5};
  for (int i = 0; i < 1000 && haply.status() != DeviceStatus::fault; ++i) {
    const DeviceState state = haply.exchange(wrench);
    require(state.p_D.allFinite() && state.v_D.allFinite() && state.p_D.cwiseAbs().maxCoeff() < 2,
            "a state is finite and within reach");
    require(state.sent_N->norm() <= HaplyDevice::kMostForce_N + 1e-9, "no force beyond the limit");
    require(state.status == DeviceStatus::ready || state.sent_N->norm() <= HaplyDevice::kProbe_N + 1e-9 ||
                state.status == DeviceStatus::fault,
            "no force unless ready");
  }
}

}  // namespace filiform::fuzz
