// Encodes and decodes the bytes of a recording (device/PROTOCOL.md), without files.
#pragma once

#include "device/recording/recorded_run.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace filiform::internal {

// Version 5 has orientations. Devices without one are recorded as version 4, so that older programs can read them.
inline constexpr std::uint32_t kRecordingVersion = 5, kPlainRecordingVersion = 4;
inline constexpr std::size_t kExchangeBytes = 200, kOrientedExchangeBytes = 232;
inline constexpr std::size_t exchangeBytes(bool oriented) { return oriented ? kOrientedExchangeBytes : kExchangeBytes; }
inline constexpr std::size_t kClosingBytes = 24;

struct RecordingHeader {
  DeviceCapabilities capabilities;
  DeviceStatus status_at_open = DeviceStatus::ready;
  bool marked = false;
  std::string device;   // name on the command line
  std::string options;  // stored verbatim, not interpreted
};

void appendHeader(std::string& out, const RecordingHeader& header);
// `oriented`: with the orientation (DeviceCapabilities::senses_orientation).
void appendExchange(std::string& out, std::uint64_t index, const RecordedExchange& exchange, bool oriented);
void appendClosing(std::string& out, std::uint64_t count);

// Decodes the header and returns its length. Throws DeviceError naming `file`.
std::size_t readHeader(const std::string& file, std::string_view bytes, RecordingHeader& header);
// Returns false if the checksum, the status or the number of marks is wrong. Requires bytes.size() >=
// exchangeBytes(oriented).
bool readExchange(std::string_view bytes, std::uint64_t index, RecordedExchange& exchange, bool oriented);
// True if the bytes are the closing mark for `count` exchanges. Requires bytes.size() >= kClosingBytes.
bool isClosing(std::string_view bytes, std::uint64_t count);

}  // namespace filiform::internal
