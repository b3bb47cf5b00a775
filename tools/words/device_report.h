// The report of a device's test, for the person and as JSON that somebody with hardware can send. tools/README.md
// describes it. Thread rule: functions without state.
#pragma once

#include "device/check/device_check.h"

#include <iosfwd>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace filiform::tools {

std::string fixed(double value, int digits);

// The device as it was named, its capabilities and transport, the results, the program and the system. No name of a
// person, a machine or a file.
nlohmann::ordered_json deviceReport(const std::string& device_name, const HapticDevice& device,
                                    const DeviceCheck& check);

void printWalk(std::ostream& out, const DeviceWalkFound& walk, bool renders_force);

}  // namespace filiform::tools
