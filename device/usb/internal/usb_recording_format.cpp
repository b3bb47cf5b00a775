#include "device/usb/internal/usb_recording_format.h"

#include "device/internal/record_bytes.h"

#include <algorithm>
#include <cmath>

namespace filiform::internal {

namespace {

constexpr std::string_view kUsbMagic{"FILIUSB\0", 8};
constexpr std::string_view kUsbClosingMagic{"FILIUND\0", 8};
constexpr std::size_t kUsbHeaderBytes = 24;
constexpr std::size_t kFixedBytes = 40;  // of a record, before its bytes

void appendText(std::string& out, const std::string& text) {
  append(out, static_cast<std::uint32_t>(text.size()));
  out.append(text);
}

std::string takeText(RecordReader& in) {
  const std::size_t size = in.get<std::uint32_t>();
  return std::string(in.take(size));
}

std::size_t recordBytes(std::size_t bytes) { return kFixedBytes + (bytes + 7) / 8 * 8 + 8; }

bool possible(const UsbRecord& record) {
  switch (record.event) {
    case UsbEvent::devices:
      return decodeDevices(record.bytes).has_value();
    case UsbEvent::open:
      if (const auto opened = decodeDevices(record.bytes); !opened || opened->size() != 1) return false;
      [[fallthrough]];
    case UsbEvent::claim:
    case UsbEvent::control:
      return record.outcome <= 1 + static_cast<std::uint8_t>(UsbCause::failed);
    case UsbEvent::submit:
    case UsbEvent::complete:
      return record.outcome <= static_cast<std::uint8_t>(UsbStatus::failed);
  }
  return false;
}

}  // namespace

void appendUsbHeader(std::string& out) {
  const std::size_t start = out.size();
  out.append(kUsbMagic);
  append(out, kUsbRecordingVersion);
  append(out, std::uint32_t{0});
  append(out, checksum(std::string_view(out).substr(start), 0));
}

bool appendUsbRecord(std::string& out, std::uint64_t index, const UsbRecord& record, std::string_view bytes) {
  const std::size_t start = out.size(), size = recordBytes(bytes.size());
  if (out.capacity() - start < size + kUsbClosingBytes) return false;
  append(out, static_cast<std::uint32_t>(size));
  append(out, static_cast<std::uint32_t>(bytes.size()));
  append(out, static_cast<std::uint8_t>(record.event));
  append(out, record.endpoint);
  append(out, record.outcome);
  append(out, std::uint8_t{0});
  append(out, record.connection);
  append(out, record.time_s);
  append(out, record.setup.request_type);
  append(out, record.setup.request);
  append(out, record.setup.value);
  append(out, record.setup.index);
  append(out, std::uint16_t{0});
  append(out, record.moved);
  append(out, std::uint32_t{0});
  out.append(bytes);
  out.resize(start + size - 8, '\0');
  append(out, checksum(std::string_view(out).substr(start), index));
  return true;
}

void appendUsbClosing(std::string& out, std::uint64_t count) {
  const std::size_t start = out.size();
  out.append(kUsbClosingMagic);
  append(out, count);
  append(out, checksum(std::string_view(out).substr(start), count));
}

std::string encodeDevices(const std::vector<UsbDeviceInfo>& devices) {
  std::string out;
  append(out, static_cast<std::uint32_t>(devices.size()));
  for (const UsbDeviceInfo& info : devices) {
    append(out, info.vendor);
    append(out, info.product);
    append(out, info.address);
    append(out, static_cast<std::uint8_t>(info.may_open ? 1 : 0));
    for (const std::string& text : {info.bus_path, info.manufacturer, info.product_name, info.serial})
      appendText(out, text);
    append(out, static_cast<std::uint8_t>(info.interfaces.size()));
    for (const UsbInterface& i : info.interfaces) {
      for (const std::uint8_t byte : {i.number, i.usb_class, i.subclass, i.protocol}) append(out, byte);
      append(out, static_cast<std::uint8_t>(i.endpoints.size()));
      for (const UsbEndpoint& e : i.endpoints) {
        append(out, e.address);
        append(out, static_cast<std::uint8_t>(e.type));
        append(out, e.max_packet);
      }
    }
  }
  return out;
}

std::optional<std::vector<UsbDeviceInfo>> decodeDevices(std::string_view bytes) {
  RecordReader in(bytes);
  std::vector<UsbDeviceInfo> devices;
  for (std::uint32_t left = in.get<std::uint32_t>(); left > 0 && in.whole(); --left) {
    UsbDeviceInfo info;
    info.vendor = in.get<std::uint16_t>();
    info.product = in.get<std::uint16_t>();
    info.address = in.get<std::uint8_t>();
    info.may_open = in.get<std::uint8_t>() != 0;
    for (std::string* text : {&info.bus_path, &info.manufacturer, &info.product_name, &info.serial})
      *text = takeText(in);
    for (int interfaces = in.get<std::uint8_t>(); interfaces > 0 && in.whole(); --interfaces) {
      UsbInterface i;
      for (std::uint8_t* byte : {&i.number, &i.usb_class, &i.subclass, &i.protocol}) *byte = in.get<std::uint8_t>();
      for (int endpoints = in.get<std::uint8_t>(); endpoints > 0 && in.whole(); --endpoints) {
        UsbEndpoint e;
        e.address = in.get<std::uint8_t>();
        const auto type = in.get<std::uint8_t>();
        if (type > static_cast<std::uint8_t>(UsbEndpointType::interrupt)) return {};
        e.type = static_cast<UsbEndpointType>(type);
        e.max_packet = in.get<std::uint16_t>();
        i.endpoints.push_back(e);
      }
      info.interfaces.push_back(std::move(i));
    }
    devices.push_back(std::move(info));
  }
  if (!in.whole() || !in.atEnd()) return {};
  return devices;
}

std::vector<UsbRecord> readUsbRecording(const std::string& file, std::string_view bytes) {
  const auto cutShort = [&] { return DeviceError(file + ": cut short at byte " + std::to_string(bytes.size())); };
  const std::string_view compared = bytes.substr(0, kUsbMagic.size());
  if (compared != kUsbMagic.substr(0, compared.size()))
    throw DeviceError(file + ": not a recording of USB traffic (it does not begin with FILIUSB)");
  if (bytes.size() < kUsbHeaderBytes) throw cutShort();
  RecordReader header(bytes.substr(kUsbMagic.size()));
  if (const auto version = header.get<std::uint32_t>(); version != kUsbRecordingVersion)
    throw DeviceError(file + ": USB recording format version " + std::to_string(version) +
                      ", this program reads version " + std::to_string(kUsbRecordingVersion));
  header.get<std::uint32_t>();
  if (checksum(bytes.substr(0, 16), 0) != header.get<std::uint64_t>())
    throw DeviceError(file + ": damaged at byte 0: the header's checksum does not match");

  std::vector<UsbRecord> records;
  std::size_t at = kUsbHeaderBytes;
  const auto damaged = [&](const char* what) {
    return DeviceError(file + ": damaged at byte " + std::to_string(at) + ", after " + std::to_string(records.size()) +
                       " whole records: " + what);
  };
  for (;;) {
    const std::string_view rest = bytes.substr(at);
    if (rest.size() < 8) throw cutShort();
    if (rest.substr(0, 8) == kUsbClosingMagic) {
      if (rest.size() < kUsbClosingBytes) throw cutShort();
      RecordReader closing(rest.substr(8));
      const auto count = closing.get<std::uint64_t>();
      if (checksum(rest.substr(0, 16), count) != closing.get<std::uint64_t>() || count != records.size())
        throw damaged("the closing mark does not match");
      at += kUsbClosingBytes;
      if (at != bytes.size()) throw damaged("bytes follow the closing mark");
      return records;
    }
    RecordReader in(rest);
    const std::size_t size = in.get<std::uint32_t>(), payload = in.get<std::uint32_t>();
    if (size != recordBytes(payload)) throw damaged("a record has an invalid length");
    if (rest.size() < size) throw cutShort();
    RecordReader stored(rest.substr(size - 8));
    if (checksum(rest.substr(0, size - 8), records.size()) != stored.get<std::uint64_t>())
      throw damaged("the record's checksum does not match");
    UsbRecord record;
    record.event = static_cast<UsbEvent>(in.get<std::uint8_t>());
    record.endpoint = in.get<std::uint8_t>();
    record.outcome = in.get<std::uint8_t>();
    in.get<std::uint8_t>();
    record.connection = in.get<std::uint32_t>();
    record.time_s = in.get<double>();
    record.setup.request_type = in.get<std::uint8_t>();
    record.setup.request = in.get<std::uint8_t>();
    record.setup.value = in.get<std::uint16_t>();
    record.setup.index = in.get<std::uint16_t>();
    in.get<std::uint16_t>();
    record.moved = in.get<std::uint32_t>();
    record.bytes = std::string(rest.substr(kFixedBytes, payload));
    if (!std::isfinite(record.time_s) || !possible(record)) throw damaged("a record holds an invalid value");
    records.push_back(std::move(record));
    at += size;
  }
}

}  // namespace filiform::internal
