#include "device/haply/haply_service.h"

#include "device/haply/internal/haply_link.h"

namespace filiform {
namespace {

const char* stateOf(const internal::HaplyStatus& status) {
  if (status.power == internal::HaplySays::no) return "no_power";
  if (status.calibrated == internal::HaplySays::no) return "not_calibrated";
  return status.ready == internal::HaplySays::no ? "not_ready" : "ready";
}

}  // namespace

HaplyServiceState askHaplyService(const HaplyOptions& options, double timeout_s, bool with_settings) {
  HaplyServiceState state;
  state.address = options.host + ':' + std::to_string(options.port);
  internal::MakeStream connect = options.connect;
  if (!connect) connect = [&] { return connectTcp(options.host, options.port, {.timeout_s = timeout_s}); };
  try {
    state.version = internal::askService(connect, options.host, "/version", timeout_s);
    internal::HaplyLink link;
    const internal::HaplyInventory inventory = link.open(connect, options.host, timeout_s);
    link.close();
    state.runs = true;
    for (const auto& device : inventory.devices)
      state.devices.push_back({device.id, stateOf(device.status), internal::obstacleOf(device.status),
                               device.status.in_use == internal::HaplySays::yes});
    state.grips = inventory.grips;
    if (!with_settings || internal::dialectFor(state.version) == internal::HaplyDialect::values) return state;
    for (HaplyServiceState::Device& device : state.devices)
      for (const char* const key : {"handedness", "preset", "mount", "damping", "gravity_compensation"}) {
        std::string value =
            internal::askService(connect, options.host, "/inverse3/" + device.id + "/config/" + key, timeout_s);
        while (!value.empty() && (value.back() == '\n' || value.back() == '\r')) value.pop_back();
        if (!value.empty()) device.settings.emplace_back(key, std::move(value));
      }
  } catch (const DeviceError& error) {
    state.trouble = error.what();
  }
  return state;
}

}  // namespace filiform
