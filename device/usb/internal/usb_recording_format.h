// Encodes and decodes recorded USB traffic (device/PROTOCOL.md), without files.
#pragma once

#include "device/usb/usb_transport.h"

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
  std::uint8_t endpoint = 0;     // submit, complete: endpoint; claim: interface
  std::uint8_t outcome = 0;      // open, claim, control: 0, or 1 + UsbCause; submit, complete: UsbStatus
  std::uint32_t connection = 0;  // number in the order of openings, from 0
  double time_s = 0;
  UsbSetup setup;           // control
  std::uint32_t moved = 0;  // control, complete: bytes; submit: length
  // devices: the list; open: a list of one device; submit, complete, control: the bytes transferred.
  std::string bytes;
};

// Appends a record. Returns false, and appends nothing, if it would exceed the reserved capacity of `out`.
bool appendUsbRecord(std::string& out, std::uint64_t index, const UsbRecord& record, std::string_view bytes);
void appendUsbHeader(std::string& out);
void appendUsbClosing(std::string& out, std::uint64_t count);
// Bytes that appendUsbClosing() needs.
inline constexpr std::size_t kUsbClosingBytes = 24;

std::string encodeDevices(const std::vector<UsbDeviceInfo>& devices);
// nullopt if the bytes are not a list of devices.
std::optional<std::vector<UsbDeviceInfo>> decodeDevices(std::string_view bytes);

// Decodes a whole file. Throws DeviceError naming `file`.
std::vector<UsbRecord> readUsbRecording(const std::string& file, std::string_view bytes);

}  // namespace filiform::internal
