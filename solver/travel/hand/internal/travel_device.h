// The device of a run or a session: created from its name, recorded if wanted, and for a replay, with what the
// recording says about each exchange.
//
// Thread rule: virtualStep_s() and mark() belong to the thread that exchanges, and are haptic-safe. All other members
// belong to the owner, while no other thread exchanges.
#pragma once

#include "device/recording/replay.h"
#include "device/simulated/simulated_hand.h"
#include "solver/loop/tick_clock.h"
#include "solver/workspace/internal/mark_bits.h"

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace filiform {

class Output;

namespace internal {

struct TravelDeviceOptions {
  std::string name;  // as makeDevice() takes it
  double period_s = 0.001;
  int delay_samples = 1;  // of a simulated hand
  // Creates the device from name and period (s), not opened. Empty: makeDevice().
  std::function<std::unique_ptr<HapticDevice>(const std::string&, double)> make{};
};

struct TravelRecordingOptions {
  std::string path;
  std::string device{};                       // stored in the recording: the name of the device
  std::string options{};                      // stored verbatim in the recording
  bool writer_thread = true;                  // false: the owner calls recorder()->drain()
  const std::atomic<bool>* cancel = nullptr;  // see OutputOptions
};

class TravelDevice {
 public:
  // Does not open the device. Throws UnknownDevice and DeviceError.
  explicit TravelDevice(const TravelDeviceOptions& options);
  ~TravelDevice();
  TravelDevice(const TravelDevice&) = delete;
  TravelDevice& operator=(const TravelDevice&) = delete;

  // Records all exchanges. Call once, before open(). Throws as Output does.
  void record(const TravelRecordingOptions& recording);

  HapticDevice& operator*() noexcept { return *device_; }
  HapticDevice* operator->() noexcept { return device_.get(); }
  const DeviceCapabilities& capabilities() const { return device_->capabilities(); }
  SimulatedHand* hand() const noexcept { return hand_; }  // nullptr: the device is not a simulated hand
  // A simulated person can lead the hand: it is simulated here, or behind a bridge.
  bool isLed() const { return hand_ != nullptr || capabilities().is_led; }
  // The hand pulls towards this point (m, frame D). Haptic-safe.
  void lead(const Eigen::Vector3d& target_D) noexcept {
    if (hand_ != nullptr) return hand_->setTarget(target_D);
    device_->lead(target_D);
  }
  const ReplayDevice* replay() const noexcept { return replay_; }   // nullptr: the device is not a replay
  RecordingDevice* recorder() const noexcept { return recorder_; }  // nullptr: no recording
  Output* recording() const noexcept { return output_.get(); }      // nullptr: no recording

  // The name of the device that the hand held: for a replay the recorded device, if the recording names it.
  const std::string& heldDevice() const noexcept { return held_; }
  // The device replays a recording with marks.
  bool replaysMarks() const noexcept { return replay_ != nullptr && replay_->marked(); }
  bool replayEnded(const DeviceState& state) const noexcept {
    return replay_ != nullptr && state.status == DeviceStatus::closed;
  }
  // The replayed run computed a tick at the last exchange. True if there are no marks.
  bool wasTicked() const noexcept { return !replaysMarks() || (replay_->marks().bits & MarkBits::kTicked) != 0; }

  // The time step (s) in virtual time for the state of the last exchange: the period; in a replay of measured time, the
  // recorded step. Call once for each exchange, in order, with the same period_s > 0.
  double virtualStep_s(const DeviceState& state, double period_s) noexcept;
  // Adds marks to the last exchange of the recording. Does nothing without a recording.
  void mark(const RunMarks& marks) noexcept {
    if (recorder_ != nullptr) recorder_->mark(marks);
  }

  // For a run that failed or was interrupted: keeps the recording so far, also of a full disk, in a second file beside
  // an older file. Returns the name of that file. Keeps nothing and returns an empty name if the recording cannot be
  // replayed, and after errors.
  std::string keepRecording() noexcept;

 private:
  std::unique_ptr<Output> output_;  // outlives the device, which writes to it
  std::unique_ptr<HapticDevice> device_;
  SimulatedHand* hand_;
  ReplayDevice* replay_;
  RecordingDevice* recorder_ = nullptr;
  std::string held_;
  std::optional<TickClock> clock_;
};

}  // namespace internal
}  // namespace filiform
