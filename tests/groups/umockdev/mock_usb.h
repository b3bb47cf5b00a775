// USB devices for the real libusb path, without hardware: umockdev answers for the kernel, a script for the device.
//
//   MockUsb usb;
//   MockUsbDevice& echo = usb.plug(info);
//   echo.onWrite([](std::uint8_t, const MockBytes& bytes, MockUsbDevice& d) { d.answer(0x81, bytes); });
//   auto connection = systemUsb().open(systemUsb().devices().at(0));
//
// Works in processes started by `umockdev-run --`, and in what those start in turn. Every system call for the device is
// a round trip through a socket: good for protocols and errors, not for timing. Thread rule: scripts are called on a
// thread of umockdev, one at a time: what a script writes for the test to read needs an atomic. The rest is internally
// synchronised.
#pragma once

#include "device/usb/usb_transport.h"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform::test {

using MockBytes = std::vector<std::uint8_t>;

class MockUsbDevice {
 public:
  using Write = std::function<void(std::uint8_t endpoint, const MockBytes& bytes, MockUsbDevice&)>;
  // What an IN request gets, any bytes for OUT; nothing to stall.
  using Control = std::function<std::optional<MockBytes>(const UsbSetup&, const MockBytes& data, MockUsbDevice&)>;

  virtual ~MockUsbDevice() = default;
  virtual const UsbDeviceInfo& info() const = 0;
  virtual void onWrite(Write script) = 0;
  // Without one all stall.
  virtual void onControl(Control script) = 0;
  // From now on this packet waits to be received on that endpoint.
  virtual void answer(std::uint8_t endpoint, const MockBytes& bytes) = 0;
  // The driver that the kernel has bound to each interface, "usbfs" for another program; free where none is named.
  virtual void bind(std::uint8_t interface, const std::string& driver) = 0;
  virtual std::map<std::uint8_t, std::string> bound() const = 0;
};

class MockUsb {
 public:
  MockUsb();
  ~MockUsb();
  MockUsb(const MockUsb&) = delete;
  MockUsb& operator=(const MockUsb&) = delete;

  // Empty if umockdev answers in this process, else why not.
  static std::string missing();

  // At info.bus_path, with a fresh address.
  MockUsbDevice& plug(const UsbDeviceInfo& info);
  // From now on the kernel knows no such device; udev says so.
  void unplug(MockUsbDevice& device);
  // From now on nobody but root may open it. Before it is opened.
  void forbid(MockUsbDevice& device);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::test
