// The bytes of a recording, as device/PROTOCOL.md specifies them: encoding and decoding, without files.
#pragma once

#include "device/replay.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace filiform::internal {

inline constexpr std::uint32_t kRecordingVersion = 4;
inline constexpr std::size_t kExchangeBytes = 200;
inline constexpr std::size_t kClosingBytes = 24;

struct RecordingHeader {
  DeviceCapabilities capabilities;
  DeviceStatus status_at_open = DeviceStatus::ready;
  bool marked = false;
  std::string device;   // as the command line named it
  std::string options;  // what the run was told, as who wrote it spells it
};

struct RecordedExchange {
  Wrench wrench;
  DeviceState state;
  RunMarks marks;
};

void appendHeader(std::string& out, const RecordingHeader& header);
void appendExchange(std::string& out, std::uint64_t index, const RecordedExchange& exchange);
void appendClosing(std::string& out, std::uint64_t count);

// Returns the length of the header. Throws DeviceError naming `file`.
std::size_t readHeader(const std::string& file, std::string_view bytes, RecordingHeader& header);
// False if the checksum, the status or the number of marks is wrong. Requires bytes.size() >= kExchangeBytes.
bool readExchange(std::string_view bytes, std::uint64_t index, RecordedExchange& exchange);
// Requires bytes.size() >= kClosingBytes.
bool isClosing(std::string_view bytes, std::uint64_t count);

}  // namespace filiform::internal
