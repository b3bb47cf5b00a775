// The devices of a browser: simulated hands, recordings, none, and a 3D mouse by WebHID. Stands in for
// device_factory.cpp in the preset `web`.
#include "device/factory/device_factory.h"

#include "device/recording/replay.h"
#include "device/simulated/null_device.h"
#include "device/simulated/simulated_hand.h"
#include "device/spacemouse/spacemouse.h"
#include "device/usb/usb_transport.h"

namespace filiform {

const char* deviceChoices() { return "sim:loose|medium|firm, replay:FILE, null, spacemouse"; }

bool isForceDevice(const std::string& /*spec*/) { return false; }

std::unique_ptr<HapticDevice> makeDevice(const std::string& spec, const DeviceFactoryOptions& options) {
  const std::size_t colon = spec.find(':');
  const std::string kind = spec.substr(0, colon), argument = colon == std::string::npos ? "" : spec.substr(colon + 1);
  if (kind == "sim") {
    SimulatedHandOptions hand;
    hand.hand = handParameters(argument.empty() ? "medium" : argument);
    hand.period_s = options.period_s;
    hand.delay_samples = options.delay_samples;
    return std::make_unique<SimulatedHand>(hand);
  }
  if (kind == "replay" && !argument.empty()) return std::make_unique<ReplayDevice>(argument);
  if (spec == "null") return std::make_unique<NullDevice>(options.period_s);
  if (spec == "spacemouse") return std::make_unique<SpaceMouse>(systemUsb());
  throw UnknownDevice("no such device '" + spec + "' in a browser; choose one of " + deviceChoices(), kind,
                      {"sim:loose", "sim:medium", "sim:firm", "replay", "null", "spacemouse"});
}

}  // namespace filiform
