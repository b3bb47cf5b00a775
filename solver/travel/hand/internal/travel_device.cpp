#include "solver/travel/hand/internal/travel_device.h"

#include "device/factory/device_factory.h"
#include "index/output.h"

#include <exception>
#include <utility>

namespace filiform::internal {

TravelDevice::TravelDevice(const TravelDeviceOptions& options)
    : device_(options.make ? options.make(options.name, options.period_s)
                           : makeDevice(options.name, {options.period_s, options.delay_samples})),
      hand_(dynamic_cast<SimulatedHand*>(device_.get())),
      replay_(dynamic_cast<ReplayDevice*>(device_.get())),
      held_(replay_ != nullptr && !replay_->device().empty() ? replay_->device() : options.name) {}

TravelDevice::~TravelDevice() = default;

void TravelDevice::record(const TravelRecordingOptions& recording) {
  RecordingOptions options;
  options.writer_thread = recording.writer_thread;
  options.device = recording.device;
  options.options = recording.options;
  options.marked = true;
  output_ = std::make_unique<Output>(recording.path,
                                     OutputOptions{.cancel = recording.cancel, .mend = [](const std::string& partial) {
                                                     if (closeRecording(partial) == 0)
                                                       throw DeviceError("nothing was recorded");
                                                   }});
  auto recorder = std::make_unique<RecordingDevice>(std::move(device_), output_->stream(), options);
  recorder_ = recorder.get();
  device_ = std::move(recorder);
}

double TravelDevice::virtualStep_s(const DeviceState& state, double period_s) noexcept {
  if (!clock_) clock_.emplace(period_s);
  const double measured_s = clock_->step_s(state.time_s);
  return replaysMarks() && (replay_->marks().bits & MarkBits::kMeasured) != 0 ? measured_s : period_s;
}

std::string TravelDevice::keepRecording() noexcept {
  if (recorder_ == nullptr) return {};
  try {
    try {
      recorder_->finish();
    } catch (const std::exception&) {
      // The caller already reports an earlier failure. A recording that could not be written is mended.
    }
    return output_->finishAside();
  } catch (const std::exception&) {
    return {};
  }
}

}  // namespace filiform::internal
