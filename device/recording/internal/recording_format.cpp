#include "device/recording/internal/recording_format.h"

#include "device/internal/record_bytes.h"

#include <algorithm>

namespace filiform::internal {

namespace {

constexpr std::string_view kMagic{"FILIREC\0", 8};
constexpr std::string_view kClosingMagic{"FILIEND\0", 8};
constexpr std::size_t kFixedHeaderBytes = 144;  // up to the names
constexpr std::uint32_t kLastStatus = static_cast<std::uint32_t>(DeviceStatus::fault);

void appendVector(std::string& out, const Eigen::Vector3d& v) {
  for (int i = 0; i < 3; ++i) append(out, v[i]);
}

Eigen::Vector3d getVector(RecordReader& in) {
  const double x = in.get<double>(), y = in.get<double>(), z = in.get<double>();
  return {x, y, z};
}

std::uint64_t storedChecksum(std::string_view bytes, std::size_t at) {
  return RecordReader(bytes.substr(at)).get<std::uint64_t>();
}

// `text_bytes`: bytes of the device's name, the name that made it and the options together.
std::size_t headerBytes(std::size_t text_bytes) { return kFixedHeaderBytes + (text_bytes + 7) / 8 * 8 + 8; }

}  // namespace

void appendHeader(std::string& out, const RecordingHeader& header) {
  const DeviceCapabilities& c = header.capabilities;
  const std::size_t start = out.size();
  const std::size_t whole = headerBytes(c.name.size() + header.device.size() + header.options.size());
  out.append(kMagic);
  append(out, c.senses_orientation ? kRecordingVersion : kPlainRecordingVersion);
  append(out, static_cast<std::uint32_t>(whole));
  append(out, static_cast<std::uint32_t>(exchangeBytes(c.senses_orientation)));
  append(out,
         static_cast<std::uint32_t>((c.senses_rotation ? 1 : 0) | (c.needs_homing ? 2 : 0) | (header.marked ? 4 : 0) |
                                    (c.rate_control ? 8 : 0) | (c.senses_orientation ? 16 : 0)));
  append(out, static_cast<std::uint32_t>(header.status_at_open));
  append(out, static_cast<std::int32_t>(c.delay_samples));
  append(out, static_cast<std::int32_t>(c.buttons));
  append(out, static_cast<std::uint32_t>(c.name.size()));
  appendVector(out, c.workspace_lo_D);
  appendVector(out, c.workspace_hi_D);
  for (const double value :
       {c.peak_force_N, c.continuous_force_N, c.max_stiffness_N_m, c.damping_Ns_m, c.resolution_m, c.nominal_rate_Hz})
    append(out, value);
  append(out, static_cast<std::uint32_t>(header.device.size()));
  append(out, static_cast<std::uint32_t>(header.options.size()));
  out.append(c.name);
  out.append(header.device);
  out.append(header.options);
  out.resize(start + whole - 8, '\0');
  append(out, checksum(std::string_view(out).substr(start), 0));
}

void appendExchange(std::string& out, std::uint64_t index, const RecordedExchange& exchange, bool oriented) {
  const auto& [wrench, state, marks] = exchange;
  const std::size_t start = out.size();
  appendVector(out, wrench.force_N);
  appendVector(out, wrench.torque_Nm);
  append(out, state.time_s);
  appendVector(out, state.p_D);
  appendVector(out, state.v_D);
  appendVector(out, state.twist_D);
  append(out, state.buttons);
  append(out, static_cast<std::uint32_t>(state.status));
  appendVector(out, state.sent_N.value_or(wrench.force_N));
  append(out, marks.bits);
  append(out, marks.count);
  for (const std::uint32_t value : marks.values) append(out, value);
  for (int i = 0; oriented && i < 4; ++i) append(out, state.orientation_D.coeffs()[i]);
  append(out, checksum(std::string_view(out).substr(start), index));
}

void appendClosing(std::string& out, std::uint64_t count) {
  const std::size_t start = out.size();
  out.append(kClosingMagic);
  append(out, count);
  append(out, checksum(std::string_view(out).substr(start), count));
}

std::size_t readHeader(const std::string& file, std::string_view bytes, RecordingHeader& header) {
  const auto damaged = [&](std::size_t at, const std::string& what) {
    return DeviceError(file + ": damaged at byte " + std::to_string(at) + ": " + what);
  };
  if (bytes.empty()) throw DeviceError(file + ": cut short at byte 0: the file is empty");
  const std::size_t compared = std::min(bytes.size(), kMagic.size());
  if (bytes.substr(0, compared) != kMagic.substr(0, compared))
    throw DeviceError(file + ": not a recording (it does not begin with FILIREC)");
  const auto cut = [&] {
    return DeviceError(file + ": cut short at byte " + std::to_string(bytes.size()) + ", within the header");
  };
  if (bytes.size() < kFixedHeaderBytes) throw cut();
  RecordReader in(bytes.substr(kMagic.size()));
  const auto version = in.get<std::uint32_t>();
  if (version != kRecordingVersion && version != kPlainRecordingVersion)
    throw DeviceError(file + ": recording format version " + std::to_string(version) +
                      ", this program reads versions " + std::to_string(kPlainRecordingVersion) + " and " +
                      std::to_string(kRecordingVersion));
  const std::size_t header_bytes = in.get<std::uint32_t>();
  const auto exchange_bytes = in.get<std::uint32_t>();
  const auto flags = in.get<std::uint32_t>();
  const auto status = in.get<std::uint32_t>();
  DeviceCapabilities& c = header.capabilities;
  c.delay_samples = in.get<std::int32_t>();
  c.buttons = in.get<std::int32_t>();
  const std::size_t name_bytes = in.get<std::uint32_t>();
  RecordReader sizes(bytes.substr(kFixedHeaderBytes - 8));
  const std::size_t device_bytes = sizes.get<std::uint32_t>(), options_bytes = sizes.get<std::uint32_t>();
  if (header_bytes != headerBytes(name_bytes + device_bytes + options_bytes))
    throw damaged(12, "the header's length does not match its texts");
  if (bytes.size() < header_bytes) throw cut();
  if (checksum(bytes.substr(0, header_bytes - 8), 0) != storedChecksum(bytes, header_bytes - 8))
    throw damaged(0, "the header's checksum does not match");
  c.senses_orientation = (flags & 16) != 0;
  if (exchange_bytes != exchangeBytes(c.senses_orientation) || status > kLastStatus ||
      c.senses_orientation != (version == kRecordingVersion))
    throw damaged(16, "the header holds an invalid value");
  header.status_at_open = static_cast<DeviceStatus>(status);
  c.senses_rotation = (flags & 1) != 0;
  c.needs_homing = (flags & 2) != 0;
  header.marked = (flags & 4) != 0;
  c.rate_control = (flags & 8) != 0;
  c.workspace_lo_D = getVector(in);
  c.workspace_hi_D = getVector(in);
  for (double* value : {&c.peak_force_N, &c.continuous_force_N, &c.max_stiffness_N_m, &c.damping_Ns_m, &c.resolution_m,
                        &c.nominal_rate_Hz})
    *value = in.get<double>();
  c.name = std::string(bytes.substr(kFixedHeaderBytes, name_bytes));
  header.device = std::string(bytes.substr(kFixedHeaderBytes + name_bytes, device_bytes));
  header.options = std::string(bytes.substr(kFixedHeaderBytes + name_bytes + device_bytes, options_bytes));
  return header_bytes;
}

bool readExchange(std::string_view bytes, std::uint64_t index, RecordedExchange& exchange, bool oriented) {
  auto& [wrench, state, marks] = exchange;
  const std::size_t size = exchangeBytes(oriented);
  bytes = bytes.substr(0, size);
  if (checksum(bytes.substr(0, size - 8), index) != storedChecksum(bytes, size - 8)) return false;
  RecordReader in(bytes);
  wrench.force_N = getVector(in);
  wrench.torque_Nm = getVector(in);
  state.time_s = in.get<double>();
  state.p_D = getVector(in);
  state.v_D = getVector(in);
  state.twist_D = getVector(in);
  state.buttons = in.get<std::uint32_t>();
  const auto status = in.get<std::uint32_t>();
  if (status > kLastStatus) return false;
  state.status = static_cast<DeviceStatus>(status);
  state.sent_N = getVector(in);
  marks.bits = in.get<std::uint32_t>();
  marks.count = in.get<std::uint32_t>();
  for (std::uint32_t& value : marks.values) value = in.get<std::uint32_t>();
  for (int i = 0; oriented && i < 4; ++i) state.orientation_D.coeffs()[i] = in.get<double>();
  return marks.count <= marks.values.size();
}

bool isClosing(std::string_view bytes, std::uint64_t count) {
  bytes = bytes.substr(0, kClosingBytes);
  return bytes.substr(0, 8) == kClosingMagic && RecordReader(bytes.substr(8)).get<std::uint64_t>() == count &&
         checksum(bytes.substr(0, 16), count) == storedChecksum(bytes, 16);
}

}  // namespace filiform::internal
