// Recordings: every exchange with a device, bit for bit, into a file (device/PROTOCOL.md has its bytes), and a device
// that plays such a file back. A run that was recorded can be repeated exactly, without the hand and without the
// hardware.
#pragma once

#include "device/haptic_device.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

namespace filiform {

// What a run must know, beside the states, to do the same again: written down with each exchange, of no meaning here.
struct RunMarks {
  std::uint32_t bits = 0;
  std::uint32_t count = 0;  // of the values
  std::array<std::uint32_t, 6> values{};
};

struct RecordingOptions {
  // How many exchanges may wait to be written. More than a minute at 1 kHz: the writer may stall that long.
  std::size_t capacity = 65536;
  // A thread writes every few milliseconds. Without it the owner calls drain(), at least once per `capacity` exchanges:
  // right for loops in virtual time, which could outrun any disk.
  bool writer_thread = true;
  std::string device{};   // words that made the device, for who replays it
  std::string options{};  // what the run was told, for who repeats it; of no meaning here
  bool marked = false;    // the run calls mark()
};

// Wraps a device and passes everything through. The stream gets the recording's bytes in order; where it goes and what
// becomes of a file that is not whole is its owner's matter. What relax() does is not recorded: nobody computed with
// its state. Thread rule: as HapticDevice; mark() is for the thread that exchanges, drain() for any, finish() for the
// owner after the haptic thread has stopped calling exchange().
class RecordingDevice : public HapticDevice {
 public:
  // The stream must outlive the device. Nothing else may write to it.
  RecordingDevice(std::unique_ptr<HapticDevice> inner, std::ostream& out, const RecordingOptions& options = {});
  // Finishes the recording if nobody did, so that a run that ended badly can be replayed; failures go unreported here.
  ~RecordingDevice() override;

  // Writes what is waiting. Throws DeviceError when the stream cannot be written, and what the stream throws; the
  // recording is then over, while exchanges go on.
  void drain();
  // Writes the rest and the closing mark, and flushes the stream. Throws as drain() does, and DeviceError if exchanges
  // came faster than they were written: the recording then holds those before the first loss, and the text says how
  // many. Does nothing the second time.
  void finish();
  // Can what was written be replayed? True after the closing mark.
  bool whole() const noexcept;

  HapticDevice& inner() noexcept;
  const DeviceCapabilities& capabilities() const override;
  DeviceStatus status() const noexcept override;
  // Opens the device and writes the recording's header. Once per object: throws DeviceError the second time.
  void open() override;
  void close() noexcept override;
  // Adds a copy into memory to the cost of the inner exchange: no file, no lock, no allocation.
  DeviceState exchange(const Wrench& wrench) noexcept override;
  void relax() noexcept override;
  // Of the last exchange. Costs a copy.
  void mark(const RunMarks& marks) noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct RecordingWords {
  std::string device, options;  // as in RecordingOptions
};
// Of a recording's header; the rest is not looked at. Throws DeviceError as ReplayDevice does.
RecordingWords readRecordingWords(const std::string& path);

// Plays a recording: the n-th exchange returns the n-th recorded state, bit for bit, whatever wrench it gets. After the
// last one the status is closed and the last state is repeated. The whole file is held in memory (0.8 GB for an hour at
// 1 kHz). Thread rule: as HapticDevice.
class ReplayDevice : public HapticDevice {
 public:
  // Reads and checks the whole file. Throws DeviceError with the byte where it is damaged or cut short, or with both
  // versions when the format is a newer one.
  explicit ReplayDevice(const std::string& path);

  std::size_t exchanges() const noexcept { return exchanges_.size(); }
  bool finished() const noexcept { return next_ == exchanges_.size(); }
  // How many wrenches since open() differed, in any bit, from those sent when the recording was made: 0 means the run
  // is the same.
  std::size_t differingWrenches() const noexcept { return differing_wrenches_; }
  // The words that made the recorded device; whether its exchanges were marked; the marks of the last one.
  const std::string& device() const noexcept { return device_; }
  bool marked() const noexcept { return marked_; }
  const RunMarks& marks() const noexcept { return marks_; }

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return state_.status; }
  // Starts again from the first exchange.
  void open() override;
  void close() noexcept override;
  DeviceState exchange(const Wrench& wrench) noexcept override;
  void relax() noexcept override {}

 private:
  struct Exchange {
    Wrench wrench;
    DeviceState state;
    RunMarks marks;
  };

  std::vector<Exchange> exchanges_;
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
