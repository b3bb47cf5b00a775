// The narrow seam between drivers and USB: what is plugged in, an opened device, and transfers that own their buffers.
//
//   for (const UsbDeviceInfo& info : systemUsb().devices()) std::cout << std::hex << info.vendor << '\n';
//   const UsbDeviceInfo info = systemUsb().devices().at(0);
//   std::unique_ptr<UsbConnection> usb = systemUsb().open(info);      // UsbError by cause
//   usb->claim(0);
//   std::unique_ptr<UsbTransfer> in = usb->makeTransfer(0x81, 64);
//   in->submit(64);
//   usb->handleEvents(0.002);                                         // on the caller's own thread
//   if (in->status() == UsbStatus::done) std::cout << in->data().size() << '\n';
//
// Transports: systemUsb() (libusb), UsbRecorder and UsbReplay (usb_recording.h), a scripted one in tests/support. Times
// are seconds of the transport's clock, which may be virtual: drivers take the time from here only. Thread rule: a
// transport is for any thread; a connection with its transfers for one thread at a time, the haptic one after set-up.
#pragma once

#include "device/haptic_device.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform {

enum class UsbCause : std::uint8_t { not_found, no_permission, busy, gone, timed_out, stalled, failed };

class UsbError : public DeviceError {
 public:
  UsbError(UsbCause cause, const std::string& text) : DeviceError(text), cause_(cause) {}
  UsbCause cause() const noexcept { return cause_; }

 private:
  UsbCause cause_;
};

// What every text about a missing permission names; installed with the program.
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
  std::string bus_path;                             // "1-2.4": the socket; the same when it is plugged in again there
  std::uint8_t address = 0;                         // another one each time it is plugged in
  std::string manufacturer, product_name, serial;   // empty where it has none
  bool may_open = true;                             // false: this user lacks the permission
  std::vector<UsbInterface> interfaces;             // of the active configuration
  bool samePlug(const UsbDeviceInfo& other) const;  // the same device, and not plugged in anew since
};

// "1-2.4 0403:cb48 FALCON HAPTIC", for texts.
std::string describe(const UsbDeviceInfo& info);

struct UsbSetup {  // of a control transfer, as USB 2.0 table 9-2 names the fields
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
  overflow,  // the device sent more than the transfer holds; its bytes are lost
  gone,      // unplugged: nothing will work any more
  failed,
};
const char* toString(UsbStatus status);

// One transfer over one endpoint, used again and again. Must not outlive its connection. Destruction cancels, and waits
// kCancelTime_s at most.
class UsbTransfer {
 public:
  static constexpr double kCancelTime_s = 0.1;

  virtual ~UsbTransfer() = default;

  // What is sent (OUT, from the front) or was received. Only while not pending.
  virtual std::span<std::uint8_t> buffer() noexcept = 0;
  // Starts it: OUT sends the first `length` bytes of the buffer, IN receives up to `length`. False, with status() gone
  // or failed, if it could not be started; requires that it is not pending, and length <= buffer().size(). No time
  // limit of its own: see UsbConnection::run() and cancel(). Nothing here allocates; libusb takes one small block.
  virtual bool submit(std::size_t length) noexcept = 0;
  // Changes only within calls of this connection and its transfers.
  virtual UsbStatus status() const noexcept = 0;
  bool pending() const noexcept { return status() == UsbStatus::pending; }
  // Bytes sent or received by the last one, also where it ended early.
  virtual std::size_t actual() const noexcept = 0;
  std::span<const std::uint8_t> data() noexcept { return buffer().first(actual()); }
  // Ends the transfer and waits `patience_s` at most until the system has returned the buffer. True: it is over
  // (cancelled, or done if it was faster) or was not pending. False: it is still pending; the buffer may not be
  // touched.
  virtual bool cancel(double patience_s = kCancelTime_s) noexcept = 0;
};

// An opened device. Destruction releases all interfaces and gives them back to the kernel drivers they were taken from.
class UsbConnection {
 public:
  virtual ~UsbConnection() = default;

  virtual const UsbDeviceInfo& info() const noexcept = 0;
  // Takes an interface, from its kernel driver if it has one. Throws UsbError busy (another program has it), gone,
  // failed.
  virtual void claim(std::uint8_t interface) = 0;
  // Gives it back, to its kernel driver too. Not claimed: no effect.
  virtual void release(std::uint8_t interface) noexcept = 0;

  // Sends or fills `data`, as the direction bit of request_type says; returns the bytes moved. Blocks, allocates: not
  // for the haptic tick. Throws UsbError timed_out, stalled (the device refused), gone, failed.
  virtual std::size_t control(const UsbSetup& setup, std::span<std::uint8_t> data, double timeout_s) = 0;

  // A transfer of up to `capacity` bytes over an endpoint of a claimed interface. Throws UsbError failed for an
  // endpoint that the device does not have, or that is neither bulk nor interrupt.
  virtual std::unique_ptr<UsbTransfer> makeTransfer(std::uint8_t endpoint, std::size_t capacity) = 0;

  // Completes transfers, on this thread. Returns as soon as at least one has completed, at the latest after
  // `timeout_s` (0: does not wait), true if one has.
  virtual bool handleEvents(double timeout_s) noexcept = 0;

  // Unplugged, as far as anything has shown it yet. It stays so: open it again when it is back.
  virtual bool gone() const noexcept = 0;
  virtual double time_s() const noexcept = 0;  // the transport's clock, monotonic

  // Submits, handles events until it is over, and cancels it when the time is up (timed_out; bytes received before that
  // are in data()). Returns after timeout_s + cancel_s at the latest; `pending` if the system does not return the
  // buffer.
  UsbStatus run(UsbTransfer& transfer, std::size_t length, double timeout_s,
                double cancel_s = UsbTransfer::kCancelTime_s) noexcept;
  // Handles events until the transfer is over, `patience_s` at most. True if it is over.
  bool await(const UsbTransfer& transfer, double patience_s) noexcept;
};

class UsbTransport {
 public:
  virtual ~UsbTransport() = default;

  // What is plugged in now, hubs aside, ordered by bus path. Looks at the system each time (milliseconds): works where
  // no daemon announces changes. Throws UsbError failed.
  virtual std::vector<UsbDeviceInfo> devices() = 0;
  // Throws UsbError no_permission (naming kUdevRule), not_found (no longer plugged in as `info` says), failed. The
  // transport must outlive the connection.
  virtual std::unique_ptr<UsbConnection> open(const UsbDeviceInfo& info) = 0;
  virtual double time_s() const noexcept = 0;  // monotonic
  // Lets time pass on that clock.
  virtual void pause(double seconds) noexcept = 0;
};

// The machine's own USB. Keeps nothing between calls.
UsbTransport& systemUsb();

struct UsbChange {
  bool arrived = false;  // else it left
  UsbDeviceInfo device;
};

// Arrivals and departures by comparing what is plugged in: the caller polls, once a second or so, on any thread but the
// haptic one. Thread rule: thread-compatible.
class UsbWatch {
 public:
  explicit UsbWatch(UsbTransport& transport) : transport_(transport) {}
  // Since the last call, departures first; all that is plugged in at the first. A device that was unplugged and
  // plugged in again in between left and arrived. Throws as UsbTransport::devices().
  std::vector<UsbChange> poll();

 private:
  UsbTransport& transport_;
  std::vector<UsbDeviceInfo> known_;
};

}  // namespace filiform
