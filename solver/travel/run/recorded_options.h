// The options of a run that a recording carries, so that a replay needs the recording alone. Stored as JSON in
// RecordingOptions::options, under the names of `filiform navigate`. Thread rule: functions without state.
#pragma once

#include "index/set/tile_store.h"
#include "solver/travel/run/run_options.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

// The text that a recording stores: the options that decide the travel. `cell`: of a single route.
std::string recordedOptions(const TileStore& store, const RunOptions& options, std::optional<std::uint32_t> cell);

// For the device "replay:FILE": sets each option that has its default, and is not in RunOptions::given, to the value in
// the recording. Returns notes for the user: the options taken, and those that differ from the recording's. Throws
// UsageError for the recording of a session, for a cell that the set has not, and for a value that this program does
// not accept; DeviceError if the file cannot be read. Does nothing for other devices.
std::vector<std::string> takeRecordedOptions(const TileStore& store, RunOptions& options);

// For RecordingOptions::options: the recording is of a Session (session.h), which stores its view and its jumps in
// FILE.json.
extern const char* const kSessionOptions;
// True if the recording is of a Session. Throws DeviceError as readRecordingWords().
bool isSessionRecording(const std::string& recording);

}  // namespace filiform
