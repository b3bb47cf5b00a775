#include "device/falcon/falcon.h"
#include "device/recording/internal/recording_format.h"
#include "device/recording/replay.h"
#include "device/spacemouse/spacemouse.h"
#include "device/usb/internal/usb_recording_format.h"
#include "device/usb/usb_recording.h"
#include "tests/fuzz/fuzz_bytes.h"

#include <vector>

#include <xxhash.h>

namespace filiform::fuzz {
namespace {

void sealed(std::string& out, std::string_view bytes, std::uint64_t index) {
  const std::size_t begin = out.size();
  out.append(bytes);
  const std::uint64_t checksum = XXH3_64bits_withSeed(out.data() + begin, bytes.size(), index);
  out.append(reinterpret_cast<const char*>(&checksum), sizeof checksum);
}

// Exchanges with any content and valid checksums.
std::string exchanges(Input input) {
  std::string out;
  internal::RecordingHeader header;
  header.device = "falcon";
  Taker in(input);
  const bool oriented = in.number<std::uint8_t>() % 2 == 1;
  header.capabilities.senses_orientation = oriented;
  internal::appendHeader(out, header);
  const std::size_t size = internal::exchangeBytes(oriented) - 8;
  std::uint64_t count = 0;
  for (; !in.empty(); ++count) {
    std::string bytes(asText(in.some(size)));
    bytes.resize(size, '\0');
    sealed(out, bytes, count);
  }
  internal::appendClosing(out, count);
  return out;
}

// The same for USB traffic: each record has its fixed part and the number of bytes that it states.
std::string traffic(Input input) {
  constexpr std::size_t kFixed = 40;
  std::string out;
  internal::appendUsbHeader(out);
  std::uint64_t count = 0;
  for (Taker in(input); !in.empty(); ++count) {
    const std::uint32_t payload = in.number<std::uint8_t>(),
                        size = (static_cast<std::uint32_t>(kFixed) + payload + 15) / 8 * 8;
    std::string bytes(reinterpret_cast<const char*>(&size), sizeof size);
    bytes.append(reinterpret_cast<const char*>(&payload), sizeof payload);
    bytes.append(asText(in.some(kFixed - 8 + payload)));
    bytes.resize(size - 8, '\0');
    sealed(out, bytes, count);
  }
  internal::appendUsbClosing(out, count);
  return out;
}

void replay(const std::string& path) {
  ReplayDevice device(path);
  device.open();
  for (std::size_t i = 0; i < device.exchanges() + 2; ++i) device.exchange({});
  require(device.finished(), "a replay comes to an end");
}

void replayUsb(const std::string& path) {
  UsbReplay usb(path);
  const auto drive = [&](HapticDevice& device) {
    try {
      device.open();
      for (int i = 0; i < 20; ++i) {
        const DeviceState state = device.exchange({});
        require(state.p_D.allFinite() && state.v_D.allFinite(), "states are finite");
      }
    } catch (const DeviceError&) {
    }
    device.close();
  };
  Falcon falcon(usb);
  drive(falcon);
  SpaceMouse mouse(usb);
  drive(mouse);
}

}  // namespace

void fuzzRecording(Input input) {
  static MemoryFile file;
  Taker in(input);
  const auto kind = in.number<std::uint8_t>() % 4;
  std::string made;
  if (kind == 1) made = exchanges(in.rest());
  if (kind == 3) made = traffic(in.rest());
  file.hold(kind % 2 == 1 ? Input(reinterpret_cast<const std::uint8_t*>(made.data()), made.size()) : in.rest());
  try {
    if (kind < 2)
      replay(file.path());
    else
      replayUsb(file.path());
  } catch (const DeviceError&) {
  }
}

}  // namespace filiform::fuzz
