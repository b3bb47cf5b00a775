#include "solver/travel/run/run.h"

#include "index/errors.h"
#include "index/output.h"
#include "solver/travel/run/internal/realtime_run.h"
#include "solver/travel/run/internal/run_parts.h"
#include "solver/travel/run/internal/virtual_run.h"
#include "solver/travel/run/recorded_options.h"
#include "solver/workspace/workspace.h"

#include <cmath>
#include <exception>
#include <string>
#include <vector>

namespace filiform {
namespace {

void checkOptions(const TileStore& store, const RunOptions& options) {
  const auto is_positive = [](double x) { return x > 0 && std::isfinite(x); };
  if (!is_positive(options.rate_Hz) || options.rate_Hz > 1e6) throw UsageError("the rate must be between 0 and 1e6 Hz");
  Workspace::requireZoom(options.zoom_um);
  if (options.seconds && !is_positive(*options.seconds)) throw UsageError("the time limit must be finite and > 0 s");
  if (!(options.latency_ms >= 0 && std::isfinite(options.latency_ms)))
    throw UsageError("the latency must be finite and >= 0 ms");
  if (options.realtime && options.latency_ms > 0)
    throw UsageError("a latency can be set in virtual time only: leave out the latency or --realtime");
  if (options.cell && *options.cell >= store.cell_count())
    throw UsageError("the set has no cell number " + std::to_string(*options.cell));
}

// Closes the device on every exit path, which sends zero force first.
struct ClosedDevice {
  explicit ClosedDevice(HapticDevice& open) : device(open) {}
  ~ClosedDevice() { device.close(); }
  ClosedDevice(const ClosedDevice&) = delete;
  ClosedDevice& operator=(const ClosedDevice&) = delete;
  HapticDevice& device;
};

void travel(internal::RunParts& parts, const internal::OnTick& on_tick) {
  const ClosedDevice closed(*parts.device);
  parts.placeAtStart();
  if (parts.options.realtime)
    internal::runInRealTime(parts, on_tick);
  else
    internal::runInVirtualTime(parts, on_tick);
  if (!parts.ended) parts.end();
}

}  // namespace

RunSummary run(const TileStore& store, const RunOptions& options, const std::function<void(const TickRow&)>& on_tick) {
  RunOptions wanted = options;
  std::vector<std::string> notes = takeRecordedOptions(store, wanted);
  checkOptions(store, wanted);
  internal::RunParts parts(store, wanted);
  parts.notes.insert(parts.notes.begin(), notes.begin(), notes.end());
  try {
    travel(parts, on_tick);
  } catch (...) {
    parts.fail(std::current_exception());
    throw;
  }
  return parts.summary();
}

}  // namespace filiform
