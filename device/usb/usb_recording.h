// Records USB traffic to a file, and replays the file in place of the devices. So a driver's run can be repeated
// without hardware. device/PROTOCOL.md specifies the file.
//
//   std::ofstream file("falcon.usb", std::ios::binary);
//   UsbRecorder recorder(systemUsb(), file);
//   {
//     Falcon falcon(recorder);
//     falcon.open();
//   }
//   recorder.finish();
//
//   UsbReplay replay("falcon.usb");
//   Falcon falcon(replay);
#pragma once

#include "device/usb/usb_transport.h"

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

namespace filiform {

// Passes all calls on to another transport and keeps the traffic in memory until finish(). Thread rule: as
// UsbTransport, but only one thread at a time may use the recorder and its connections.
class UsbRecorder : public UsbTransport {
 public:
  static constexpr std::size_t kCapacity = std::size_t{64} << 20;  // bytes: some minutes of a device at 1 kHz

  // Allocates all its memory here, so that recording never allocates. The inner transport and the stream must outlive
  // this object.
  UsbRecorder(UsbTransport& inner, std::ostream& out, std::size_t capacity = kCapacity);
  // Calls finish() if it was not called, and ignores errors. Requires that all connections are destroyed.
  ~UsbRecorder() override;

  // Writes the recording to the stream and ends it; a second call does nothing. Throws DeviceError if it cannot be
  // written. Throws DeviceError if the capacity was too small; the recording then holds the traffic before that. Throws
  // what the stream throws.
  void finish();

  std::vector<UsbDeviceInfo> devices() override;
  std::unique_ptr<UsbConnection> open(const UsbDeviceInfo& info) override;
  double time_s() const noexcept override { return inner_.time_s(); }
  void pause(double seconds) noexcept override { inner_.pause(seconds); }

 private:
  friend class RecordedConnection;
  friend class RecordedTransfer;
  class Writer;
  UsbTransport& inner_;
  std::unique_ptr<Writer> writer_;
};

// Answers as the recorded devices did. Lists, openings, claims and control requests are answered in recorded order.
// Transfers complete in recorded order on each endpoint, at their recorded time. The replay's clock advances only while
// its user waits. After the last record the device is gone. Thread rule: as UsbRecorder.
class UsbReplay : public UsbTransport {
 public:
  // Reads and checks the whole file. Throws DeviceError naming the byte if the file is damaged or truncated, or naming
  // both versions if the format is another version.
  explicit UsbReplay(const std::string& path);
  ~UsbReplay() override;

  // Number of requests and writes so far that differ from the recording in any byte. 0: the driver did the same.
  std::size_t differing() const noexcept;
  // True after the last record was used.
  bool finished() const noexcept;

  std::vector<UsbDeviceInfo> devices() override;
  std::unique_ptr<UsbConnection> open(const UsbDeviceInfo& info) override;
  double time_s() const noexcept override;
  void pause(double seconds) noexcept override;

 private:
  friend class ReplayedConnection;
  friend class ReplayedTransfer;
  struct Traffic;
  std::unique_ptr<Traffic> traffic_;
};

}  // namespace filiform
