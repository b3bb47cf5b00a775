// The messages of the Haply Inverse Service: states that it sends, commands that it takes. Both are JSON texts; the
// frame H is the service's: metres and newtons, x right, y away from the person, z up, origin on the mounting plate.
// Sources: docs.haply.co, pages on the WebSocket protocol and on control commands. Thread rule: functions without
// state.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace filiform::internal {

// The name of a force in a command. The service silently ignores a name that it does not know.
enum class HaplyDialect : std::uint8_t { vector, values };  // from 3.5 on; before
const char* toString(HaplyDialect dialect) noexcept;
// The dialect for the answer to GET /version, whose form is not specified: the first "A.B" in it counts. Without one:
// vector.
HaplyDialect dialectFor(std::string_view version) noexcept;

enum class HaplySays : std::uint8_t { nothing, no, yes };
struct HaplyStatus {
  HaplySays calibrated = HaplySays::nothing, ready = HaplySays::nothing, power = HaplySays::nothing,
            in_use = HaplySays::nothing;
};
// Names the obstacle that keeps a device from rendering force, and tells the person the remedy. Returns a static text,
// empty if the device can render force.
const char* obstacleOf(const HaplyStatus& status) noexcept;

struct HaplyReading {
  bool has_device = false;    // the message has a state of the device
  bool has_position = false;  // fields below; without it, they keep the values of the last message
  bool has_orientation = false;
  Eigen::Vector3d position_H = Eigen::Vector3d::Zero();  // m
  Eigen::Vector3d velocity_H = Eigen::Vector3d::Zero();  // m/s
  Eigen::Vector3d force_H = Eigen::Vector3d::Zero();     // N, that the device renders now, of all programs together
  std::array<double, 4> orientation_H{1, 0, 0, 0};       // of the grip: w, x, y, z
  std::uint32_t buttons = 0;                             // of the grip
  HaplyStatus status;                                    // what a message leaves out stays as it was
};

// Reads a state of the device `id`, given as the service writes it, into `reading`. A vector without a component has 0
// there, because the service may leave out what is zero. Buttons and orientation are those of the first grip. Returns
// false if the text is not a JSON object; the reading then has no device, and the rest is as before. Does not allocate.
bool readState(std::string_view text, std::string_view id, HaplyReading& reading) noexcept;

struct HaplyInventory {
  struct Device {
    std::string id;
    HaplyStatus status;
    bool is_led = false;  // a simulated hand that takes aims: only a SimulatedHaply says so, as "filiform_is_led"
  };
  std::vector<Device> devices;
  std::vector<std::string> grips;
  int buttons = 0;  // of the first grip: a VerseGrip has one, a wireless one three
};
// Reads the devices of the first message of a session. Returns false if the text is not a JSON object.
bool readInventory(std::string_view text, HaplyInventory& inventory);

inline constexpr std::size_t kMostHaplyId = 64;   // characters
inline constexpr std::size_t kMostCommand = 768;  // bytes
struct HaplyCommand {
  std::string_view id{};  // of the device; at most kMostHaplyId characters
  HaplyDialect dialect = HaplyDialect::vector;
  Eigen::Vector3d force_H = Eigen::Vector3d::Zero();  // N, finite
  // Where a simulated hand shall go (m, finite), as "filiform_aim"; nullptr: none. A real service ignores this name.
  const Eigen::Vector3d* aim_H = nullptr;
};
// Writes a command. The first command of a session also names the program. Returns its length. Requires kMostCommand
// bytes of memory. Does not allocate.
std::size_t writeCommand(std::span<char> into, const HaplyCommand& command, bool is_first) noexcept;

}  // namespace filiform::internal
