// UsbTransport: the interface between drivers and USB. It lists devices, opens them, and makes transfers that own their
// buffers.
//
//   for (const UsbDeviceInfo& info : systemUsb().devices()) std::cout << std::hex << info.vendor << '\n';
//   const UsbDeviceInfo info = systemUsb().devices().at(0);
//   std::unique_ptr<UsbConnection> usb = systemUsb().open(info);      // throws UsbError by cause
//   usb->claim(0);
//   std::unique_ptr<UsbTransfer> in = usb->makeTransfer(0x81, 64);
//   in->submit(64);
//   usb->handleEvents(0.002);                                         // on the calling thread
//   if (in->status() == UsbStatus::done) std::cout << in->data().size() << '\n';
//
// Transports: systemUsb() (libusb), UsbRecorder and UsbReplay (usb_recording.h), a scripted one in tests/support. Times
// are seconds on the transport's clock, which may be virtual; drivers use no other clock. Thread rule: any thread may
// use a transport. One thread at a time uses a connection with its transfers: after set-up the haptic one.
#pragma once

#include "device/haptic_device.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform {

// Cause of a UsbError.
enum class UsbCause : std::uint8_t { not_found, no_permission, busy, gone, timed_out, stalled, failed };

class UsbError : public DeviceError {
 public:
  UsbError(UsbCause cause, const std::string& text) : DeviceError(text), cause_(cause) {}
  UsbCause cause() const noexcept { return cause_; }

 private:
  UsbCause cause_;
};

// The udev rule that every text about missing permission names; it is installed with the program.
inline constexpr const char* kUdevRule = "70-filiform.rules";

enum class UsbEndpointType : std::uint8_t { control, isochronous, bulk, interrupt };

struct UsbEndpoint {
  std::uint8_t address = 0;  // with the direction bit: 0x81 is IN 1
  UsbEndpointType type = UsbEndpointType::bulk;
  std::uint16_t max_packet = 64;  // bytes
  bool in() const noexcept { return (address & 0x80) != 0; }
};

struct UsbInterface {  // its first alternate setting
  std::uint8_t number = 0;
  std::uint8_t usb_class = 0xff, subclass = 0, protocol = 0;  // class 3: HID
  std::vector<UsbEndpoint> endpoints;
};

struct UsbDeviceInfo {
  std::uint16_t vendor = 0, product = 0;
  std::string bus_path;                             // "1-2.4": the USB socket; the same if plugged in there again
  std::uint8_t address = 0;                         // changes each time the device is plugged in
  std::string manufacturer, product_name, serial;   // empty if the device has none
  bool may_open = true;                             // false: the user lacks permission
  std::vector<UsbInterface> interfaces;             // of the active configuration
  bool samePlug(const UsbDeviceInfo& other) const;  // same device, not unplugged in between
};

// "1-2.4 0403:cb48 FALCON HAPTIC", for messages.
std::string describe(const UsbDeviceInfo& info);

struct UsbSetup {  // setup packet of a control transfer; names of USB 2.0, table 9-2
  std::uint8_t request_type = 0;
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  bool in() const noexcept { return (request_type & 0x80) != 0; }
};

enum class UsbStatus : std::uint8_t {
  idle,  // never submitted
  pending,
  done,
  timed_out,
  cancelled,
  stalled,
  overflow,  // the device sent more than fits; the bytes are lost
  gone,      // unplugged: all further calls fail
  failed,
};
const char* toString(UsbStatus status);

// A reusable transfer over one endpoint. Must not outlive its connection. The destructor cancels it and waits at most
// kCancelTime_s.
class UsbTransfer {
 public:
  static constexpr double kCancelTime_s = 0.1;

  virtual ~UsbTransfer() = default;

  // Bytes to send (OUT, from the front) or received (IN). Must not be used while pending.
  virtual std::span<std::uint8_t> buffer() noexcept = 0;
  // Starts the transfer. OUT sends the first `length` bytes of the buffer; IN receives up to `length`. Returns false,
  // with status() gone or failed, if it cannot start. Requires that it is not pending and length <= buffer().size().
  // Has no time limit: use UsbConnection::run() or cancel(). filiform does not allocate here; libusb allocates one
  // small block.
  virtual bool submit(std::size_t length) noexcept = 0;
  // Changes only inside calls of this connection and its transfers.
  virtual UsbStatus status() const noexcept = 0;
  bool pending() const noexcept { return status() == UsbStatus::pending; }
  // Bytes that the last transfer sent or received, also if it ended early.
  virtual std::size_t actual() const noexcept = 0;
  std::span<const std::uint8_t> data() noexcept { return buffer().first(actual()); }
  // Ends the transfer and waits at most `patience_s` until the system returns the buffer. True: it has ended
  // (cancelled, or done if it was faster) or was not pending. False: it is still pending, and the buffer must not be
  // touched.
  virtual bool cancel(double patience_s = kCancelTime_s) noexcept = 0;
};

// An open device. The destructor releases all interfaces and returns them to their kernel drivers.
class UsbConnection {
 public:
  virtual ~UsbConnection() = default;

  virtual const UsbDeviceInfo& info() const noexcept = 0;
  // Claims an interface, from its kernel driver if it has one. Throws UsbError: busy (another program uses it), gone,
  // failed.
  virtual void claim(std::uint8_t interface) = 0;
  // Releases an interface and returns it to its kernel driver. No effect if it is not claimed.
  virtual void release(std::uint8_t interface) noexcept = 0;

  // Sends `data` or fills it, by the direction bit of request_type. Returns the number of bytes moved. Blocks and
  // allocates: not for the haptic tick. Throws UsbError: timed_out, stalled (the device refused), gone, failed.
  virtual std::size_t control(const UsbSetup& setup, std::span<std::uint8_t> data, double timeout_s) = 0;

  // Makes a transfer of up to `capacity` bytes over an endpoint of a claimed interface. Throws UsbError failed if the
  // device lacks the endpoint or it is neither bulk nor interrupt.
  virtual std::unique_ptr<UsbTransfer> makeTransfer(std::uint8_t endpoint, std::size_t capacity) = 0;

  // Completes transfers on the calling thread. Returns true as soon as one has completed, false after `timeout_s` (0:
  // does not wait).
  virtual bool handleEvents(double timeout_s) noexcept = 0;

  // True once a call has shown that the device is unplugged. It stays true: open the device again when it is back.
  virtual bool gone() const noexcept = 0;
  virtual double time_s() const noexcept = 0;  // the transport's clock, monotonic

  // Submits a transfer and handles events until it ends. Cancels it after timeout_s; the result is then timed_out, and
  // data() holds the bytes received so far. Returns within timeout_s + cancel_s: `pending` if the system does not
  // return the buffer.
  UsbStatus run(UsbTransfer& transfer, std::size_t length, double timeout_s,
                double cancel_s = UsbTransfer::kCancelTime_s) noexcept;
  // Handles events until the transfer ends, at most `patience_s`. Returns true if it has ended.
  bool await(const UsbTransfer& transfer, double patience_s) noexcept;
};

class UsbTransport {
 public:
  virtual ~UsbTransport() = default;

  // Lists the devices now plugged in, without hubs, ordered by bus path. Asks the system each time (milliseconds), so
  // it also works without a daemon that announces changes. Throws UsbError failed.
  virtual std::vector<UsbDeviceInfo> devices() = 0;
  // Opens a device. The transport must outlive the connection. Throws UsbError: no_permission (naming kUdevRule),
  // not_found (no longer plugged in as `info` says), failed.
  virtual std::unique_ptr<UsbConnection> open(const UsbDeviceInfo& info) = 0;
  virtual double time_s() const noexcept = 0;  // monotonic
  // Waits `seconds` on the transport's clock.
  virtual void pause(double seconds) noexcept = 0;
};

// The machine's own USB. Keeps no state between calls.
UsbTransport& systemUsb();

struct UsbChange {
  bool arrived = false;  // false: it left
  UsbDeviceInfo device;
};

// Detects plugging and unplugging by comparing lists. The caller polls about once a second, on any thread except the
// haptic one. Thread rule: thread-compatible.
class UsbWatch {
 public:
  explicit UsbWatch(UsbTransport& transport) : transport_(transport) {}
  // Changes since the last call, departures first; the first call returns all devices as arrived. A device unplugged
  // and plugged in again counts as left and arrived. Throws as UsbTransport::devices() does.
  std::vector<UsbChange> poll();

 private:
  UsbTransport& transport_;
  std::vector<UsbDeviceInfo> known_;
};

}  // namespace filiform
