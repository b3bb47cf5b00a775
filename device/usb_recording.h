// Real traffic over USB into a file, and that file in the place of the device: what a driver met once can be met again,
// without the hardware. device/PROTOCOL.md has the file's bytes.
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

#include "device/usb_transport.h"

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

namespace filiform {

// Passes everything through, and keeps it in memory until finish(). Thread rule: as UsbTransport, but one thread at a
// time for the recorder and all its connections together.
class UsbRecorder : public UsbTransport {
 public:
  static constexpr std::size_t kCapacity = std::size_t{64} << 20;  // bytes; some minutes of a device at 1 kHz

  // Takes the memory at once, so that recording allocates nothing later. The inner transport and the stream must
  // outlive it.
  UsbRecorder(UsbTransport& inner, std::ostream& out, std::size_t capacity = kCapacity);
  // Finishes the recording if nobody did; failures go unreported here. Connections must be gone.
  ~UsbRecorder() override;

  // Writes all of it to the stream. Throws DeviceError when it cannot be written, or when the capacity did not suffice:
  // the recording then holds all that came before. Throws what the stream throws. Nothing is recorded after it. Does
  // nothing the second time.
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

// Answers as the recorded device did. Lists, openings, claims and control requests are answered in their order; what
// was received and sent completes in its order on each endpoint, at its time on the replay's own clock, which moves
// only while its users wait. After the last of it the device is gone. Thread rule: as UsbRecorder.
class UsbReplay : public UsbTransport {
 public:
  // Reads and checks the whole file. Throws DeviceError with the byte where it is damaged or cut short, or with both
  // versions when the format is a newer one.
  explicit UsbReplay(const std::string& path);
  ~UsbReplay() override;

  // Requests and writes so far that were not those of the recording, in any byte. 0: the driver did the same.
  std::size_t differing() const noexcept;
  // Everything recorded has been asked for.
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
