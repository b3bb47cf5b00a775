#include "tests/groups/umockdev/mock_usb.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <deque>
#include <list>
#include <mutex>
#include <stdexcept>
#include <sys/ioctl.h>
#include <sys/stat.h>

// After sys/ioctl.h, which it needs and does not include.
#include <linux/usbdevice_fs.h>
#include <umockdev.h>

namespace filiform::test {

namespace {

struct Unref {
  void operator()(UMockdevIoctlData* data) const { umockdev_ioctl_data_unref(data); }
};
using IoctlData = std::unique_ptr<UMockdevIoctlData, Unref>;

template <typename T>
T& as(const IoctlData& data) {
  return *reinterpret_cast<T*>(data->data);
}

IoctlData resolve(UMockdevIoctlData* from, std::size_t offset, std::size_t size) {
  IoctlData data(umockdev_ioctl_data_resolve(from, offset, size, nullptr));
  if (!data) throw std::runtime_error("umockdev cannot read the caller's memory");
  return data;
}

std::string hexOf(const MockBytes& bytes) {
  std::string text;
  char digits[3];
  for (const std::uint8_t byte : bytes) {
    std::snprintf(digits, sizeof digits, "%02X", byte);
    text += digits;
  }
  return text;
}

// USB 2.0, 9.6: the device's descriptor and that of its one configuration.
MockBytes descriptorsOf(const UsbDeviceInfo& info) {
  const auto lo = [](unsigned v) { return static_cast<std::uint8_t>(v & 0xff); };
  const auto hi = [](unsigned v) { return static_cast<std::uint8_t>(v >> 8); };
  MockBytes bytes{18, 1, 0, 2, 0, 0, 0, 8, lo(info.vendor), hi(info.vendor), lo(info.product), hi(info.product),
                  0,  1, 1, 2, 3, 1};
  MockBytes rest;
  for (const UsbInterface& i : info.interfaces) {
    rest.insert(rest.end(), {9, 4, i.number, 0, lo(static_cast<unsigned>(i.endpoints.size())), i.usb_class, i.subclass,
                             i.protocol, 0});
    for (const UsbEndpoint& e : i.endpoints)
      rest.insert(rest.end(),
                  {7, 5, e.address, static_cast<std::uint8_t>(e.type), lo(e.max_packet), hi(e.max_packet), 1});
  }
  const auto total = static_cast<unsigned>(9 + rest.size());
  bytes.insert(bytes.end(),
               {9, 2, lo(total), hi(total), lo(static_cast<unsigned>(info.interfaces.size())), 1, 0, 0x80, 50});
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  return bytes;
}

std::string number3(unsigned value) {
  char text[8];
  std::snprintf(text, sizeof text, "%03u", value);
  return text;
}

}  // namespace

// One transfer that the kernel holds.
struct Flight {
  IoctlData urb, buffer;
  bool ready = false, discarded = false;
};

class MockDevice : public MockUsbDevice {
 public:
  explicit MockDevice(UsbDeviceInfo info) : info_(std::move(info)), handler(umockdev_ioctl_base_new()) {
    g_signal_connect(handler, "handle-ioctl", G_CALLBACK(&MockDevice::onIoctl), this);
  }
  ~MockDevice() override { g_object_unref(handler); }
  MockDevice(const MockDevice&) = delete;
  MockDevice& operator=(const MockDevice&) = delete;

  const UsbDeviceInfo& info() const override { return info_; }
  void onWrite(Write script) override {
    const std::lock_guard lock(mutex_);
    on_write_ = std::move(script);
  }
  void onControl(Control script) override {
    const std::lock_guard lock(mutex_);
    on_control_ = std::move(script);
  }
  void answer(std::uint8_t endpoint, const MockBytes& bytes) override {
    const std::lock_guard lock(mutex_);
    packets_[endpoint].push_back(bytes);
  }
  void bind(std::uint8_t interface, const std::string& driver) override {
    const std::lock_guard lock(mutex_);
    bound_[interface] = driver;
  }
  std::map<std::uint8_t, std::string> bound() const override {
    const std::lock_guard lock(mutex_);
    return bound_;
  }

  std::string devname() const { return "/dev/bus/usb/001/" + number3(info_.address); }
  std::string syspath() const { return "/devices/pci0000:00/0000:00:14.0/usb1/" + info_.bus_path; }

  UsbDeviceInfo info_;
  UMockdevIoctlBase* handler;

  void vanish() {
    const std::lock_guard lock(mutex_);
    gone_ = true;
    // What was on its way can still be reaped, as from the kernel.
    for (Flight& flight : flights_) {
      flight.ready = true;
      as<usbdevfs_urb>(flight.urb).status = -ESHUTDOWN;
      as<usbdevfs_urb>(flight.urb).actual_length = 0;
    }
  }

 private:
  struct Answer {
    long result = 0;
    int error = 0;
  };
  static constexpr Answer failed(int error) { return {-1, error}; }

  static gboolean onIoctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    Answer answer;
    try {
      auto& device = *static_cast<MockDevice*>(self);
      const gulong request = umockdev_ioctl_client_get_request(client);
      if (request == USBDEVFS_CLAIMINTERFACE || request == USBDEVFS_DISCONNECT_CLAIM) device.takeOver(client);
      answer = device.handle(request, umockdev_ioctl_client_get_arg(client));
    } catch (const std::exception&) {
      answer = failed(EFAULT);
    }
    umockdev_ioctl_client_complete(client, answer.result, answer.error);
    return TRUE;
  }

  // umockdev does not tell when a program was killed: the next program that claims takes over, as after its end.
  void takeOver(UMockdevIoctlClient* client) {
    const std::lock_guard lock(mutex_);
    if (claimer_ != nullptr && client != claimer_) {
      std::erase_if(bound_, [](const auto& one) { return one.second == "usbfs"; });
      flights_.clear();
      packets_.clear();
    }
    g_object_ref(client);  // so that no later one has its address
    if (claimer_ != nullptr) g_object_unref(claimer_);
    claimer_ = client;
  }

  Answer handle(unsigned long request, UMockdevIoctlData* argument) {
    const std::lock_guard lock(mutex_);
    if (gone_ && (request != USBDEVFS_REAPURBNDELAY || flights_.empty())) return failed(ENODEV);
    switch (request) {
      case USBDEVFS_GET_CAPABILITIES:
        as<std::uint32_t>(resolve(argument, 0, sizeof(std::uint32_t))) =
            USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
        return {};
      case USBDEVFS_CLAIMINTERFACE: {
        const auto interface = as<unsigned>(resolve(argument, 0, sizeof(unsigned)));
        return claim(static_cast<std::uint8_t>(interface), false);
      }
      case USBDEVFS_DISCONNECT_CLAIM: {
        const IoctlData data = resolve(argument, 0, sizeof(usbdevfs_disconnect_claim));
        return claim(static_cast<std::uint8_t>(as<usbdevfs_disconnect_claim>(data).interface), true);
      }
      case USBDEVFS_RELEASEINTERFACE: {
        const auto interface = as<unsigned>(resolve(argument, 0, sizeof(unsigned)));
        bound_.erase(static_cast<std::uint8_t>(interface));
        return {};
      }
      case USBDEVFS_IOCTL: {
        const IoctlData data = resolve(argument, 0, sizeof(usbdevfs_ioctl));
        const auto& command = as<usbdevfs_ioctl>(data);
        if (command.ioctl_code != static_cast<int>(USBDEVFS_CONNECT)) return failed(ENOTTY);
        const auto interface = static_cast<std::uint8_t>(command.ifno);
        const auto was = detached_.find(interface);
        if (was == detached_.end()) return {};
        bound_[interface] = was->second;
        detached_.erase(was);
        return {1, 0};
      }
      case USBDEVFS_SUBMITURB:
        return submit(argument);
      case USBDEVFS_REAPURBNDELAY:
        return reap(argument);
      case USBDEVFS_DISCARDURB: {
        const auto address = *reinterpret_cast<const gulong*>(argument->data);
        for (Flight& flight : flights_) {
          if (flight.urb->client_addr != address || flight.ready) continue;
          flight.ready = flight.discarded = true;
          return {};
        }
        return failed(EINVAL);
      }
      default:
        return failed(ENOTTY);
    }
  }

  Answer claim(std::uint8_t interface, bool takes_from_kernel) {
    const auto bound = bound_.find(interface);
    if (bound != bound_.end()) {
      if (!takes_from_kernel || bound->second == "usbfs") return failed(EBUSY);
      detached_[interface] = bound->second;
    }
    bound_[interface] = "usbfs";
    return {};
  }

  Answer submit(UMockdevIoctlData* argument) {
    Flight flight;
    flight.urb = resolve(argument, 0, sizeof(usbdevfs_urb));
    auto& urb = as<usbdevfs_urb>(flight.urb);
    flight.buffer =
        resolve(flight.urb.get(), offsetof(usbdevfs_urb, buffer), static_cast<std::size_t>(urb.buffer_length));
    std::uint8_t* const bytes = flight.buffer->data;
    if (urb.type == USBDEVFS_URB_TYPE_CONTROL) {
      const UsbSetup setup{bytes[0], bytes[1], static_cast<std::uint16_t>(bytes[2] | bytes[3] << 8),
                           static_cast<std::uint16_t>(bytes[4] | bytes[5] << 8)};
      const MockBytes data(bytes + 8, bytes + urb.buffer_length);
      const auto answer = on_control_ ? on_control_(setup, data, *this) : std::nullopt;
      urb.status = answer ? 0 : -EPIPE;
      urb.actual_length = static_cast<int>(data.size());
      if (answer && setup.in()) {
        urb.actual_length = static_cast<int>(std::min(answer->size(), data.size()));
        std::copy_n(answer->begin(), urb.actual_length, bytes + 8);
      }
      flight.ready = true;
    } else if ((urb.endpoint & 0x80) == 0) {
      urb.status = 0;
      urb.actual_length = urb.buffer_length;
      flight.ready = true;
      const MockBytes data(bytes, bytes + urb.buffer_length);
      const std::uint8_t endpoint = urb.endpoint;
      if (on_write_) on_write_(endpoint, data, *this);
    }
    flights_.push_back(std::move(flight));
    return {};
  }

  Answer reap(UMockdevIoctlData* argument) {
    for (auto flight = flights_.begin(); flight != flights_.end(); ++flight) {
      auto& urb = as<usbdevfs_urb>(flight->urb);
      if (flight->discarded) {
        urb.status = -ENOENT;
        urb.actual_length = 0;
      } else if (!flight->ready) {
        auto& waiting = packets_[urb.endpoint];
        if (waiting.empty()) continue;
        const MockBytes& packet = waiting.front();
        const auto room = static_cast<std::size_t>(urb.buffer_length);
        urb.status = packet.size() > room ? -EOVERFLOW : 0;
        urb.actual_length = static_cast<int>(std::min(packet.size(), room));
        std::copy_n(packet.begin(), urb.actual_length, flight->buffer->data);
        waiting.pop_front();
      }
      const IoctlData pointer = resolve(argument, 0, sizeof(void*));
      umockdev_ioctl_data_set_ptr(pointer.get(), 0, flight->urb.get());
      reaped_ = std::move(*flight);  // it is written back when this call is answered
      flights_.erase(flight);
      return {};
    }
    return failed(EAGAIN);
  }

  // Recursive: scripts are called under it, and answer.
  mutable std::recursive_mutex mutex_;
  Write on_write_;
  Control on_control_;
  bool gone_ = false;
  UMockdevIoctlClient* claimer_ = nullptr;
  std::map<std::uint8_t, std::string> bound_, detached_;
  std::map<std::uint8_t, std::deque<MockBytes>> packets_;
  std::list<Flight> flights_;
  Flight reaped_;
};

struct MockUsb::Impl {
  std::string root() const {
    const std::unique_ptr<gchar, decltype(&g_free)> folder(umockdev_testbed_get_root_dir(testbed), &g_free);
    return folder.get();
  }

  UMockdevTestbed* testbed = umockdev_testbed_new();
  std::vector<std::unique_ptr<MockDevice>> devices;
  std::uint8_t next_address = 2;
  ~Impl() { g_object_unref(testbed); }
};

MockUsb::MockUsb() : impl_(std::make_unique<Impl>()) {}

MockUsb::~MockUsb() {
  for (const auto& device : impl_->devices) {
    device->vanish();
    umockdev_testbed_detach_ioctl(impl_->testbed, device->devname().c_str(), nullptr);
  }
}

std::string MockUsb::missing() {
  return umockdev_in_mock_environment() ? "" : "start it with umockdev-run -- (ctest does)";
}

MockUsbDevice& MockUsb::plug(const UsbDeviceInfo& info) {
  impl_->devices.push_back(std::make_unique<MockDevice>(info));
  MockDevice& device = *impl_->devices.back();
  device.info_.address = impl_->next_address++;
  GError* error = nullptr;
  // First the calls, then the device: it is announced as it is added.
  bool ok = umockdev_testbed_attach_ioctl(impl_->testbed, device.devname().c_str(), device.handler, &error);
  char product[32];
  std::snprintf(product, sizeof product, "%x/%x/100", info.vendor, info.product);
  const std::string number = number3(device.info_.address);
  std::string text =
      "P: " + device.syspath() + "\nN: bus/usb/001/" + number +
      "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: DRIVER=usb\nE: BUSNUM=001\nE: DEVNUM=" + number +
      "\nE: DEVNAME=" + device.devname() + "\nE: MAJOR=189\nE: MINOR=" + std::to_string(device.info_.address - 1) +
      "\nE: PRODUCT=" + product +
      "\nA: bConfigurationValue=1\\n\nA: busnum=1\\n\nA: devnum=" + std::to_string(device.info_.address) +
      "\\n\nA: speed=12\\n\n";
  if (!info.product_name.empty()) text += "A: product=" + info.product_name + "\\n\n";
  if (!info.manufacturer.empty()) text += "A: manufacturer=" + info.manufacturer + "\\n\n";
  if (!info.serial.empty()) text += "A: serial=" + info.serial + "\\n\n";
  text += "H: descriptors=" + hexOf(descriptorsOf(info)) + "\n";
  ok = ok && umockdev_testbed_add_from_string(impl_->testbed, text.c_str(), &error);
  if (!ok) {
    const std::string why = error != nullptr ? error->message : "unknown";
    g_clear_error(&error);
    throw std::runtime_error("umockdev refused a device: " + why);
  }
  return device;
}

void MockUsb::forbid(MockUsbDevice& device) {
  const std::string folder = impl_->root(), devname = dynamic_cast<MockDevice&>(device).devname();
  // umockdev ends a process that may not reach the socket of a device, even if it may not open the device.
  if (::chmod((folder + devname).c_str(), 0) != 0 || ::chmod((folder + "/ioctl" + devname).c_str(), 0777) != 0 ||
      ::chmod(folder.c_str(), 0777) != 0)
    throw std::runtime_error("cannot change permissions in " + folder);
}

void MockUsb::unplug(MockUsbDevice& device) {
  auto& mock = dynamic_cast<MockDevice&>(device);
  mock.vanish();
  const std::string path = "/sys" + mock.syspath();
  umockdev_testbed_uevent(impl_->testbed, path.c_str(), "remove");
  umockdev_testbed_remove_device(impl_->testbed, path.c_str());
}

}  // namespace filiform::test
