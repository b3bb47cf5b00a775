#include "device/check/found_devices.h"

#include "device/bridge/bridge_folder.h"
#include "device/factory/device_factory.h"
#include "device/falcon/falcon.h"
#include "device/gamepad/gamepad_port.h"
#include "device/haply/haply_device.h"
#include "device/spacemouse/spacemouse.h"

#include <algorithm>
#include <cstdlib>
#include <unistd.h>

namespace filiform::tools {

namespace {

constexpr double kServiceTime_s = 0.2;

}  // namespace

std::vector<FoundDevice> devicesOf(const HaplyServiceState& service) {
  std::vector<FoundDevice> found;
  for (const HaplyServiceState::Device& one : service.devices) {
    FoundDevice device;
    device.kind = "Haply Inverse3";
    device.device = "haply," + one.id;
    device.info.product_name = one.id;
    device.state = one.state;
    device.remedy = one.remedy;
    for (const auto& [name, value] : one.settings)
      device.settings += (device.settings.empty() ? "" : ", ") + name + ' ' + value;
    if (device.remedy.empty() && one.in_use) device.remedy = "another program uses it: forces of all programs add up";
    found.push_back(std::move(device));
  }
  return found;
}

std::vector<FoundDevice> findDevices(UsbTransport& transport) {
  std::vector<FoundDevice> found;
  for (const UsbDeviceInfo& info : transport.devices()) {
    FoundDevice device;
    device.info = info;
    device.state = "ready";
    if (info.vendor == kFalconVendor && info.product == kFalconProduct) {
      device.kind = "Novint Falcon";
      device.device = "falcon";
      const char* file = std::getenv(kFalconFirmwareVariable);
      if (file == nullptr || ::access(file, R_OK) != 0) {
        device.state = "no_firmware";
        device.remedy =
            std::string(file == nullptr ? "no firmware file is named" : "the firmware file cannot be read") + ": set " +
            kFalconFirmwareVariable +
            ", or give falcon:FILE; the file comes with Novint's driver. Not needed while the device keeps the "
            "firmware that was loaded since it got power";
      }
    } else if (isSpaceMouse(info)) {
      device.kind = "3Dconnexion mouse";
      device.device = "spacemouse:" + info.bus_path;
    } else {
      continue;
    }
    if (!info.may_open) {
      device.state = "no_permission";
      device.remedy = "install device/udev/";
      device.remedy += kUdevRule;
      device.remedy += " (cmake --install does), then plug the device in again";
    }
    found.push_back(std::move(device));
  }
  const auto isFalcon = [](const FoundDevice& device) { return device.device == "falcon"; };
  if (std::count_if(found.begin(), found.end(), isFalcon) > 1)
    for (FoundDevice& device : found)
      if (isFalcon(device)) device.device += "," + device.info.bus_path;
  return found;
}

std::vector<FoundDevice> findPads() {
  std::vector<FoundDevice> found;
  for (const FoundGamepad& pad : findGamepads()) {
    FoundDevice device;
    device.kind = pad.rumbles ? "gamepad with rumble" : "gamepad without rumble";
    device.device = "gamepad:" + pad.path;
    device.info.product_name = pad.name;
    device.state = pad.may_open ? "ready" : "no_permission";
    if (!pad.may_open) device.remedy = "log in at this machine itself, or join the group input, then log in again";
    found.push_back(std::move(device));
  }
  return found;
}

std::vector<FoundDevice> findBridgedDevices() {
  std::vector<FoundDevice> found;
  for (const FoundBridge& bridge : findBridges()) {
    FoundDevice device;
    device.kind = "bridge";
    device.device = "bridge:" + bridge.path;
    device.state = bridge.listens ? "ready" : "not_running";
    if (!bridge.listens) device.remedy = "no program listens at this socket: start the bridge again";
    found.push_back(std::move(device));
  }
  return found;
}

bool isPluggedIn(UsbTransport& transport, const std::string& spec) {
  const std::string device = withoutDirect(spec);
  if (device == "haply" || device.starts_with("haply:") || device.starts_with("haply,")) {
    const HaplyOptions options = haplyOptions(device.substr(5));
    const HaplyServiceState service = askHaplyService(options, kServiceTime_s);
    return std::any_of(service.devices.begin(), service.devices.end(), [&](const HaplyServiceState::Device& one) {
      return options.id.empty() || one.id == options.id;
    });
  }
  if (device == "gamepad" || device.starts_with("gamepad:")) {
    const std::vector<FoundGamepad> pads = findGamepads();
    return std::any_of(pads.begin(), pads.end(), [&](const FoundGamepad& pad) {
      return pad.may_open && (device == "gamepad" || device == "gamepad:" + pad.path);
    });
  }
  const std::vector<FoundDevice> found = findDevices(transport);
  const bool is_falcon = device == "falcon" || device.starts_with("falcon:") || device.starts_with("falcon,");
  const std::string socket = is_falcon ? falconOptions(device.substr(6)).bus_path : "";
  return std::any_of(found.begin(), found.end(), [&](const FoundDevice& one) {
    if (!one.info.may_open) return false;
    if (is_falcon)
      return one.device.starts_with("falcon") &&
             (socket.empty() || socket == one.info.bus_path || socket == one.info.serial);
    return device == one.device || one.device.starts_with(device + ":");  // "spacemouse" is any "spacemouse:1-2"
  });
}

}  // namespace filiform::tools
