// Records every exchange with a device to a file, and replays such a file as a device, bit for bit. So a run can be
// repeated exactly, without person and hardware. device/PROTOCOL.md specifies the file.
#pragma once

#include "device/haptic_device.h"
#include "device/recording/recorded_run.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

namespace filiform {

struct RecordingOptions {
  // Number of exchanges that may wait to be written. 65536 is more than a minute at 1 kHz, so the disk may stall that
  // long.
  std::size_t capacity = 65536;
  // True: a thread writes every few milliseconds. False: the owner calls drain() at least once every `capacity`
  // exchanges; use it for loops in virtual time, which can be faster than a disk.
  bool writer_thread = true;
  std::string device{};   // name that made the device; stored for replay
  std::string options{};  // stored verbatim in the recording; not interpreted
  bool marked = false;    // the run calls mark()
};

// Wraps a device, passes every call on, and writes the exchanges to a stream. The owner handles the file, also if the
// recording is incomplete. relax() is not recorded, since its state is not used. Thread rule: as HapticDevice. The
// thread that calls exchange() calls mark(). Any thread may call drain(). The owner calls finish() after the last
// exchange().
class RecordingDevice : public HapticDevice {
 public:
  // The stream must outlive this object; nothing else may write to it.
  RecordingDevice(std::unique_ptr<HapticDevice> inner, std::ostream& out, const RecordingOptions& options = {});
  // Calls finish() if it was not called, and ignores errors. A run that ended badly can then be replayed.
  ~RecordingDevice() override;

  // Writes the waiting exchanges. Throws DeviceError if the stream cannot be written, and what the stream throws.
  // Recording then ends; exchanges continue.
  void drain();
  // Writes the remaining exchanges and the closing mark, then flushes the stream; a second call does nothing. Throws as
  // drain() does. Throws DeviceError if exchanges came faster than they were written. The recording then ends before
  // the first lost exchange, and the text states their number.
  void finish();
  // True once the closing mark is written: the recording can be replayed.
  bool whole() const noexcept;

  HapticDevice& inner() noexcept;
  const DeviceCapabilities& capabilities() const override;
  DeviceStatus status() const noexcept override;
  // Opens the device and writes the recording's header. Throws DeviceError if called a second time.
  void open() override;
  void close() noexcept override;
  // Costs a copy in memory more than the inner exchange(): no file access, no lock, no allocation.
  DeviceState exchange(const Wrench& wrench) noexcept override;
  void relax() noexcept override;
  void lead(const Eigen::Vector3d& target_D) noexcept override;
  const char* advice() const noexcept override;
  // Stores marks with the last exchange. Costs a copy.
  void mark(const RunMarks& marks) noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The texts in a recording's header.
struct RecordingWords {
  std::string device, options;  // as in RecordingOptions
};
// Reads only the header of a recording. Throws DeviceError as ReplayDevice does.
RecordingWords readRecordingWords(const std::string& path);

// Makes a recording that was cut off, as by a full disk, replayable: drops what follows its last whole exchange, and
// puts the closing mark there. Needs no more room than the file has. Does nothing to a whole recording. Returns the
// number of exchanges. Throws DeviceError if the header is not whole, or if the file cannot be read or written.
// O(bytes).
std::size_t closeRecording(const std::string& path);

// Replays a recording. The n-th exchange returns the n-th recorded state, bit for bit, whatever the wrench. After the
// last exchange, the status is closed and the last state repeats. Holds the whole file in memory (0.9 GB for an hour at
// 1 kHz). Thread rule: as HapticDevice.
class ReplayDevice : public HapticDevice {
 public:
  // Reads and checks the whole file. Throws DeviceError naming the byte if the file is damaged or truncated, or naming
  // both versions if the format is another version.
  explicit ReplayDevice(const std::string& path);

  std::size_t exchanges() const noexcept { return exchanges_.size(); }
  bool finished() const noexcept { return next_ == exchanges_.size(); }
  // Number of wrenches since open() that differ in any bit from the recorded ones. 0: the run is identical.
  std::size_t differingWrenches() const noexcept { return differing_wrenches_; }
  // The name that made the recorded device; whether exchanges have marks; the marks of the last exchange.
  const std::string& device() const noexcept { return device_; }
  bool marked() const noexcept { return marked_; }
  const RunMarks& marks() const noexcept { return marks_; }

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return state_.status; }
  // Restarts at the first exchange.
  void open() override;
  void close() noexcept override;
  DeviceState exchange(const Wrench& wrench) noexcept override;
  void relax() noexcept override {}

 private:
  std::vector<internal::RecordedExchange> exchanges_;
  DeviceCapabilities capabilities_;
  DeviceStatus status_at_open_ = DeviceStatus::ready;
  std::string device_;
  bool marked_ = false;
  RunMarks marks_;
  std::size_t next_ = 0;
  std::size_t differing_wrenches_ = 0;
  DeviceState state_;
};

}  // namespace filiform
