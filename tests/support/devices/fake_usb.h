// USB without hardware, in virtual time. Devices are scripts: functions from bytes written to bytes sent. Faults are
// set in advance. The same calls give the same results to the bit.
//
//   FakeUsb usb;
//   FakeUsbDevice& echo = usb.plug(info);
//   echo.on_write = [](std::uint8_t, std::span<const std::uint8_t> bytes, FakeUsbDevice& device) {
//     device.answer(0x81, bytes, 0.001);
//   };
//   echo.fault({.kind = FakeUsbFault::Kind::lost, .at = 7});   // the 8th packet to the host never arrives
//   auto connection = usb.open(usb.devices().at(0));
//
// A packet sent completes one transfer. Time passes only in handleEvents(), run(), control() and pause(). After plug()
// and open(), transfers and events allocate nothing if the scripts allocate nothing. It also checks its user: see
// violations(). Thread rule: one thread.
#pragma once

#include "device/usb/usb_transport.h"

#include <array>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <random>

namespace filiform::test {

class FakeUsb;

struct FakeUsbFault {
  enum class Kind {
    truncated,  // the packet keeps its first `bytes` bytes
    split,      // the packet comes as two, the first with `bytes` bytes
    merged,     // the packet comes together with the next one
    lost,       // the packet never comes
    garbage,    // seeded random bytes replace the packet
    silent,     // from this packet on nothing more is received: reads never complete
    deaf,       // from this transfer on no read and no write completes
    stuck,      // as deaf, and a cancelled transfer is not returned
    stalled,    // this transfer ends stalled
    failed,     // this transfer ends failed
    unplugged,  // the device is unplugged when this transfer is submitted
  };
  Kind kind{};
  // From 0, since the device was plugged in. The first five kinds and `silent` count packets sent on any endpoint. The
  // others count transfers submitted in either direction.
  std::uint64_t at = 0;
  std::size_t bytes = 1;
  std::uint64_t seed = 1;
};

class FakeUsbDevice {
 public:
  static constexpr std::size_t kMaxPacket = 512;  // more bytes come as several packets

  using Write = std::function<void(std::uint8_t endpoint, std::span<const std::uint8_t> bytes, FakeUsbDevice&)>;
  // Fills `data` for IN, reads it for OUT. Returns the number of bytes moved, or nullopt to stall.
  using Control =
      std::function<std::optional<std::size_t>(const UsbSetup&, std::span<std::uint8_t> data, FakeUsbDevice&)>;
  // Called when a read is submitted while no packet waits: for a device that always sends something.
  using Read = std::function<void(std::uint8_t endpoint, FakeUsbDevice&)>;

  Write on_write;
  Control on_control;  // without it, every control transfer succeeds and moves data.size() bytes
  Read on_read;

  UsbDeviceInfo info;
  bool permitted = true;                    // false: open() throws no_permission
  std::vector<std::uint8_t> busy;           // interfaces claimed by another program
  std::vector<std::uint8_t> kernel_driven;  // interfaces with a kernel driver: detached at claim, attached afterwards
  double write_s = 100e-6;                  // time from submission to completion of a write
  double control_s = 100e-6;

  // Sends a packet to the host. It arrives in `delay_s`, after the packets already sent on this endpoint.
  void answer(std::uint8_t endpoint, std::span<const std::uint8_t> bytes, double delay_s = 0);
  void fault(const FakeUsbFault& fault) { faults_.push_back(fault); }
  // Removes all packets that wait to be received.
  void purge();

  double time_s() const noexcept;
  std::uint64_t packets() const noexcept { return packets_; }      // sent so far
  std::uint64_t transfers() const noexcept { return transfers_; }  // submitted so far
  std::uint64_t lost() const noexcept { return lost_; }            // packets lost because the queue was full
  bool plugged() const noexcept { return plugged_; }
  const std::vector<std::uint8_t>& claimed() const noexcept { return claimed_; }

 private:
  friend class FakeUsb;
  friend class FakeConnection;
  friend class FakeTransfer;
  struct Packet {
    std::array<std::uint8_t, kMaxPacket> bytes;
    std::size_t size = 0;
    double due_s = 0;
  };
  struct Queue {
    std::vector<Packet> ring;
    std::size_t first = 0, count = 0;
    bool joins_next = false;
    Packet& at(std::size_t i) { return ring[(first + i) % ring.size()]; }
  };
  FakeUsbDevice(FakeUsb& usb, UsbDeviceInfo what);
  void push(Queue& queue, std::span<const std::uint8_t> bytes, double due_s);
  bool faultNow(FakeUsbFault::Kind kind, std::uint64_t index, FakeUsbFault* found = nullptr) const;
  bool reached(FakeUsbFault::Kind kind, std::uint64_t index) const;

  FakeUsb& usb_;
  std::map<std::uint8_t, Queue> queues_;  // by IN endpoint
  std::vector<FakeUsbFault> faults_;
  std::vector<std::uint8_t> claimed_, detached_;
  std::uint64_t packets_ = 0, transfers_ = 0, lost_ = 0;
  bool plugged_ = true, open_ = false;
};

class FakeUsb : public UsbTransport {
 public:
  FakeUsb();
  ~FakeUsb() override;

  // Length of an endpoint's queue for devices plugged in from now on. Further packets are lost and counted.
  std::size_t queue_packets = 1024;

  // Plugs a device in. It exists until the end of the transport, also after unplug(). Address 0 is replaced by a new
  // address.
  FakeUsbDevice& plug(const UsbDeviceInfo& info);
  void unplug(FakeUsbDevice& device);
  // Unplugs the device at this time.
  void unplugAt(FakeUsbDevice& device, double time_s);

  // Mistakes of the transport's user: transfers on interfaces that are not claimed, submitted while pending, or too
  // long; buffers changed during a transfer; transfers that outlive their connection. Empty in a good test.
  const std::vector<std::string>& violations() const noexcept { return violations_; }

  std::vector<UsbDeviceInfo> devices() override;
  std::unique_ptr<UsbConnection> open(const UsbDeviceInfo& info) override;
  double time_s() const noexcept override { return time_s_; }
  void pause(double seconds) noexcept override;

 private:
  friend class FakeUsbDevice;
  friend class FakeConnection;
  friend class FakeTransfer;
  void advanceTo(double time_s) noexcept;

  std::vector<std::unique_ptr<FakeUsbDevice>> devices_;
  std::vector<std::pair<double, FakeUsbDevice*>> unplugs_;
  std::vector<std::string> violations_;
  double time_s_ = 0;
  std::uint8_t next_address_ = 1;
};

// A typical device: interface 0 with bulk IN 0x81 and bulk OUT 0x02.
UsbDeviceInfo fakeBulkDevice(std::uint16_t vendor, std::uint16_t product, const std::string& bus_path,
                             const std::string& name);

}  // namespace filiform::test
