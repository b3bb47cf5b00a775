// The bytes of recorded USB traffic, as device/PROTOCOL.md specifies them: encoding and decoding, without files.
#pragma once

#include "device/usb_transport.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

inline constexpr std::uint32_t kUsbRecordingVersion = 1;

enum class UsbEvent : std::uint8_t { devices, open, claim, control, submit, complete };

struct UsbRecord {
  UsbEvent event{};
  std::uint8_t endpoint = 0;     // submit, complete; of claim the interface
  std::uint8_t outcome = 0;      // open, claim, control: 0, or 1 + UsbCause; submit, complete: UsbStatus
  std::uint32_t connection = 0;  // counted from 0 as they are opened
  double time_s = 0;
  UsbSetup setup;           // control
  std::uint32_t moved = 0;  // control, complete: bytes; submit: length
  // devices: the list; open: the device, as a list of one; submit, complete, control: what went over the line.
  std::string bytes;
};

// Appends nothing and returns false if it would exceed the reserved capacity of `out`.
bool appendUsbRecord(std::string& out, std::uint64_t index, const UsbRecord& record, std::string_view bytes);
void appendUsbHeader(std::string& out);
void appendUsbClosing(std::string& out, std::uint64_t count);
// What appendUsbClosing needs.
inline constexpr std::size_t kUsbClosingBytes = 24;

std::string encodeDevices(const std::vector<UsbDeviceInfo>& devices);
// Nothing if the bytes are none.
std::optional<std::vector<UsbDeviceInfo>> decodeDevices(std::string_view bytes);

// The whole file. Throws DeviceError naming `file`.
std::vector<UsbRecord> readUsbRecording(const std::string& file, std::string_view bytes);

}  // namespace filiform::internal
