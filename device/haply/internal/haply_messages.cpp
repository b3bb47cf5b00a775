#include "device/haply/internal/haply_messages.h"

#include "device/haply/internal/json_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace filiform::internal {
namespace {

bool readVector(JsonReader& in, Eigen::Vector3d& out) noexcept {
  Eigen::Vector3d read = Eigen::Vector3d::Zero();
  const bool is_object = in.object([&](std::string_view key) noexcept {
    if (key == "x") in.number(read.x());
    if (key == "y") in.number(read.y());
    if (key == "z") in.number(read.z());
  });
  if (is_object) out = read;
  return is_object;
}

// A quaternion without a component has 0 there, and w = 1 if it has none at all. One that has no direction is refused.
bool readQuaternion(JsonReader& in, std::array<double, 4>& out) noexcept {
  std::array<double, 4> read{0, 0, 0, 0};
  bool any = false;
  const bool is_object = in.object([&](std::string_view key) noexcept {
    constexpr std::string_view kNames = "wxyz";
    const std::size_t at = key.size() == 1 ? kNames.find(key[0]) : std::string_view::npos;
    if (at != std::string_view::npos && in.number(read[at])) any = true;
  });
  if (!is_object) return false;
  if (!any) read[0] = 1;
  double most = 0;
  for (const double part : read) most = std::max(most, std::abs(part));
  if (!(most > 1e-6 && most < 1e6)) return false;
  double square = 0;
  for (const double part : read) square += part * part;
  for (double& part : read) part /= std::sqrt(square);
  out = read;
  return true;
}

void readBoolean(JsonReader& in, HaplySays& out) noexcept {
  bool said = false;
  if (in.boolean(said)) out = said ? HaplySays::yes : HaplySays::no;
}

void readStatus(JsonReader& in, HaplyStatus& status) noexcept {
  in.object([&](std::string_view key) noexcept {
    if (key == "calibrated") readBoolean(in, status.calibrated);
    if (key == "ready") readBoolean(in, status.ready);
    if (key == "power_supply") readBoolean(in, status.power);
    if (key == "in_use") readBoolean(in, status.in_use);
  });
}

// The members of a device's "state".
void readDevice(JsonReader& in, HaplyReading& reading) noexcept {
  reading.velocity_H.setZero();
  reading.force_H.setZero();
  in.object([&](std::string_view key) noexcept {
    if (key == "cursor_position" && readVector(in, reading.position_H)) reading.has_position = true;
    if (key == "cursor_velocity") readVector(in, reading.velocity_H);
    if (key == "current_cursor_force") readVector(in, reading.force_H);
  });
}

void readGrip(JsonReader& in, HaplyReading& reading) noexcept {
  std::uint32_t buttons = 0;
  const auto button = [&](std::uint32_t bit) noexcept {
    bool held = false;
    if (in.boolean(held) && held) buttons |= bit;
  };
  in.object([&](std::string_view key) noexcept {
    if (key == "button") button(1);
    if (key == "buttons")
      in.object([&](std::string_view name) noexcept {
        if (name == "a") button(1);
        if (name == "b") button(2);
        if (name == "c") button(4);
      });
    if (key == "orientation" && readQuaternion(in, reading.orientation_H)) reading.has_orientation = true;
  });
  reading.buttons = buttons;
}

bool isGrip(std::string_view key) noexcept { return key == "verse_grip" || key == "wireless_verse_grip"; }

char* put(char* at, std::string_view text) noexcept { return std::copy(text.begin(), text.end(), at); }

char* put(char* at, double value) noexcept { return std::to_chars(at, at + 32, value).ptr; }

char* put(char* at, const Eigen::Vector3d& v) noexcept {
  at = put(put(at, R"({"x":)"), v.x());
  at = put(put(at, R"(,"y":)"), v.y());
  return put(put(put(at, R"(,"z":)"), v.z()), "}");
}

}  // namespace

const char* toString(HaplyDialect dialect) noexcept { return dialect == HaplyDialect::vector ? "vector" : "values"; }

HaplyDialect dialectFor(std::string_view version) noexcept {
  for (std::size_t at = 0; at + 2 < version.size(); ++at) {
    if (version[at] < '0' || version[at] > '9') continue;
    int major = 0, minor = 0;
    const char* const end = version.data() + version.size();
    const auto [after_major, wrong_major] = std::from_chars(version.data() + at, end, major);
    if (wrong_major != std::errc() || after_major == end || *after_major != '.') {
      at = static_cast<std::size_t>(after_major - version.data());
      continue;
    }
    if (std::from_chars(after_major + 1, end, minor).ec != std::errc()) break;
    return major > 3 || (major == 3 && minor >= 5) ? HaplyDialect::vector : HaplyDialect::values;
  }
  return HaplyDialect::vector;
}

const char* obstacleOf(const HaplyStatus& status) noexcept {
  if (status.power == HaplySays::no) return "the Inverse3 has no power: connect its power supply and switch it on";
  if (status.calibrated == HaplySays::no)
    return "the Inverse3 is not calibrated: calibrate it as its manual says, then let it rest";
  if (status.ready == HaplySays::no)
    return "the Inverse3 is not ready: look at its lamps, and close other programs that use it";
  return "";
}

bool readState(std::string_view text, std::string_view id, HaplyReading& reading) noexcept {
  JsonReader in(text);
  HaplyReading read = reading;
  read.has_device = read.has_position = read.has_orientation = false;
  bool has_grip = false;
  const bool is_object = in.object([&](std::string_view key) noexcept {
    if (key == "inverse3") {
      in.array([&]() noexcept {
        // The id may come after the state: read into a copy.
        HaplyReading one = read;
        bool is_ours = false;
        in.object([&](std::string_view member) noexcept {
          std::string_view name;
          if (member == "device_id" && in.string(name)) is_ours = name == id;
          if (member == "state") readDevice(in, one);
          if (member == "status") readStatus(in, one.status);
        });
        if (!is_ours || read.has_device) return;
        read = one;
        read.has_device = true;
      });
    } else if (isGrip(key)) {
      in.array([&]() noexcept {
        in.object([&](std::string_view member) noexcept {
          if (member != "state" || has_grip) return;
          has_grip = true;
          readGrip(in, read);
        });
      });
    }
  });
  if (!is_object || !in.atEnd()) {
    reading.has_device = reading.has_position = reading.has_orientation = false;
    return false;
  }
  reading = read;
  return true;
}

bool readInventory(std::string_view text, HaplyInventory& inventory) {
  JsonReader in(text);
  HaplyInventory read;
  const bool is_object = in.object([&](std::string_view key) {
    const bool is_device = key == "inverse3";
    if (!is_device && !isGrip(key)) return;
    in.array([&] {
      HaplyInventory::Device device;
      in.object([&](std::string_view member) {
        std::string_view id;
        if (member == "device_id" && in.string(id)) device.id = id;
        if (member == "status") readStatus(in, device.status);
        if (member == "config")
          in.object([&](std::string_view name) {
            if (name == "filiform_is_led") in.boolean(device.is_led);
          });
      });
      if (device.id.empty() || device.id.size() > kMostHaplyId) return;
      if (is_device)
        read.devices.push_back(device);
      else
        read.grips.push_back(device.id);
      if (read.buttons == 0 && !read.grips.empty()) read.buttons = key == "verse_grip" ? 1 : 3;
    });
  });
  if (!is_object || !in.atEnd()) return false;
  inventory = std::move(read);
  return true;
}

std::size_t writeCommand(std::span<char> into, const HaplyCommand& command, bool is_first) noexcept {
  char* at = put(into.data(), "{");
  if (is_first)
    at = put(at, R"("session":{"configure":{"profile":{"name":"org.filiform:main"},"basis":{"permutation":"XYZ"}}},)");
  at = put(at, R"("inverse3":[{"device_id":")");
  at = put(at, command.id);
  at = put(at, R"(","commands":{"set_cursor_force":{")");
  at = put(at, toString(command.dialect));
  at = put(at, R"(":)");
  at = put(at, command.force_H);
  at = put(at, "}");
  if (command.aim_H != nullptr) {
    at = put(at, R"(,"filiform_aim":{"position":)");
    at = put(at, *command.aim_H);
    at = put(at, "}");
  }
  at = put(at, "}}]}");
  return static_cast<std::size_t>(at - into.data());
}

}  // namespace filiform::internal
