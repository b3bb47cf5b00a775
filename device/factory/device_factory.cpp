#include "device/factory/device_factory.h"

#include "device/bridge/bridge_device.h"
#include "device/falcon/falcon.h"
#include "device/gamepad/gamepad.h"
#include "device/haply/haply_device.h"
#include "device/process/process_device.h"
#include "device/recording/replay.h"
#include "device/simulated/null_device.h"
#include "device/simulated/simulated_hand.h"
#include "device/spacemouse/spacemouse.h"
#include "device/usb/usb_transport.h"

namespace filiform {

const char* deviceChoices() {
  return "sim:loose|medium|firm, replay:FILE, null, falcon[:FIRMWARE][,SOCKET][,direct], spacemouse[:SOCKET], "
         "gamepad[:NODE], "
         "haply[:HOST:PORT][,ID][,direct], bridge[:PATH|udp:HOST:PORT]";
}

std::string withoutDirect(const std::string& spec) {
  constexpr std::string_view kDirect = ",direct";
  return spec.ends_with(kDirect) ? spec.substr(0, spec.size() - kDirect.size()) : spec;
}

bool isForceDevice(const std::string& spec) {
  const std::string kind = spec.substr(0, spec.find_first_of(":,"));
  return kind == "falcon" || kind == "haply";
}

std::string fileOfDevice(const std::string& spec) {
  if (spec.starts_with("falcon:")) return falconOptions(withoutDirect(spec).substr(6)).firmware;
  return spec.starts_with("replay:") ? spec.substr(7) : "";
}

std::unique_ptr<HapticDevice> makeDevice(const std::string& given, const DeviceFactoryOptions& options) {
  const std::string direct = withoutDirect(given);
  const bool renders = isForceDevice(direct);
  const std::string& spec = renders ? direct : given;
  const std::size_t colon = spec.find(':');
  const std::string kind = spec.substr(0, colon);
  UsbTransport& usb = options.usb != nullptr ? *options.usb : systemUsb();
  const std::string argument = colon == std::string::npos ? "" : spec.substr(colon + 1);
  if (renders && spec == given && options.usb == nullptr && !options.direct) {
    if (spec.starts_with("haply")) static_cast<void>(haplyOptions(spec.substr(5)));  // refuses a wrong name here
    return std::make_unique<ProcessDevice>(ProcessDeviceOptions{.device = spec, .period_s = options.period_s});
  }
  if (kind == "sim") {
    SimulatedHandOptions hand;
    hand.hand = handParameters(colon == std::string::npos ? "medium" : argument);
    hand.period_s = options.period_s;
    hand.delay_samples = options.delay_samples;
    return std::make_unique<SimulatedHand>(hand);
  }
  if (kind == "replay") {
    if (argument.empty()) throw UnknownDevice("device replay: name the recording, as in replay:run.rec");
    return std::make_unique<ReplayDevice>(argument);
  }
  if (spec == "null") return std::make_unique<NullDevice>(options.period_s);
  if (kind == "falcon" || spec.starts_with("falcon,"))
    return std::make_unique<Falcon>(usb, falconOptions(spec.substr(6)));
  if (kind == "spacemouse") {
    SpaceMouseOptions mouse;
    mouse.bus_path = argument;
    return std::make_unique<SpaceMouse>(usb, mouse);
  }
  if (kind == "gamepad") {
    GamepadOptions pad;
    pad.path = argument;
    return std::make_unique<Gamepad>(std::move(pad));
  }
  if (kind == "bridge") {
    BridgeOptions bridge;
    bridge.address = argument;
    bridge.period_s = options.period_s;
    return std::make_unique<BridgeDevice>(bridge);
  }
  if (renders) return std::make_unique<HaplyDevice>(haplyOptions(spec.substr(5)));
  throw UnknownDevice(
      "no such device '" + spec + "'; choose one of " + deviceChoices(), kind,
      {"sim:loose", "sim:medium", "sim:firm", "replay", "null", "falcon", "spacemouse", "gamepad", "haply", "bridge"});
}

}  // namespace filiform
