// systemUsb() by libusb.
#include "device/usb/usb_transport.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <libusb.h>
#include <optional>
#include <thread>
#include <unistd.h>
#include <utility>

namespace filiform {

namespace {

double monotonic_s() noexcept {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

timeval timevalOf(double seconds) noexcept {
  const double whole = std::floor(std::clamp(seconds, 0.0, 1e6));
  return {static_cast<time_t>(whole), static_cast<suseconds_t>((std::clamp(seconds, 0.0, 1e6) - whole) * 1e6)};
}

// One context for each listing and each connection. A context knows the devices at its creation and what udev announced
// since; a new one needs no announcements. So a connection's events are also handled only by its own thread.
class Context {
 public:
  Context() {
    if (const int error = libusb_init(&context_); error != 0)
      throw UsbError(UsbCause::failed, std::string("USB cannot be used on this machine: ") + libusb_strerror(error));
  }
  ~Context() { libusb_exit(context_); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  libusb_context* get() const noexcept { return context_; }

 private:
  libusb_context* context_ = nullptr;
};

class DeviceList {
 public:
  explicit DeviceList(const Context& context) : count_(libusb_get_device_list(context.get(), &list_)) {
    if (count_ < 0)
      throw UsbError(UsbCause::failed, std::string("USB devices cannot be listed: ") +
                                           libusb_strerror(static_cast<libusb_error>(count_)));
  }
  ~DeviceList() { libusb_free_device_list(list_, 1); }
  DeviceList(const DeviceList&) = delete;
  DeviceList& operator=(const DeviceList&) = delete;
  libusb_device** begin() const noexcept { return list_; }
  libusb_device** end() const noexcept { return list_ + count_; }

 private:
  libusb_device** list_ = nullptr;
  ssize_t count_;
};

std::string busPathOf(libusb_device* device) {
  std::uint8_t ports[8];
  const int depth = libusb_get_port_numbers(device, ports, static_cast<int>(std::size(ports)));
  std::string path = std::to_string(libusb_get_bus_number(device));
  for (int i = 0; i < depth; ++i) path += (i == 0 ? '-' : '.') + std::to_string(ports[i]);
  return path;
}

// The kernel read these strings when the device was plugged in. Asking the device needs permission and disturbs a
// driver.
std::string attributeOf(const std::string& bus_path, const char* name) {
  std::ifstream in("/sys/bus/usb/devices/" + bus_path + "/" + name);
  std::string line;
  std::getline(in, line);
  return line;
}

bool mayOpen(libusb_device* device) {
  char node[32];
  std::snprintf(node, sizeof node, "/dev/bus/usb/%03u/%03u", libusb_get_bus_number(device),
                libusb_get_device_address(device));
  return ::access(node, R_OK | W_OK) == 0 || errno != EACCES;
}

UsbEndpointType endpointTypeOf(std::uint8_t attributes) {
  constexpr UsbEndpointType kTypes[] = {UsbEndpointType::control, UsbEndpointType::isochronous, UsbEndpointType::bulk,
                                        UsbEndpointType::interrupt};
  return kTypes[attributes & 3];
}

// nullopt for a hub, or a device unplugged meanwhile.
std::optional<UsbDeviceInfo> infoOf(libusb_device* device) {
  libusb_device_descriptor descriptor{};
  if (libusb_get_device_descriptor(device, &descriptor) != 0 || descriptor.bDeviceClass == LIBUSB_CLASS_HUB) return {};
  UsbDeviceInfo info;
  info.vendor = descriptor.idVendor;
  info.product = descriptor.idProduct;
  info.bus_path = busPathOf(device);
  info.address = libusb_get_device_address(device);
  info.manufacturer = attributeOf(info.bus_path, "manufacturer");
  info.product_name = attributeOf(info.bus_path, "product");
  info.serial = attributeOf(info.bus_path, "serial");
  info.may_open = mayOpen(device);
  libusb_config_descriptor* config = nullptr;
  if (libusb_get_active_config_descriptor(device, &config) != 0) return info;
  for (int i = 0; i < config->bNumInterfaces; ++i) {
    if (config->interface[i].num_altsetting < 1) continue;
    const libusb_interface_descriptor& first = config->interface[i].altsetting[0];
    UsbInterface interface {
      first.bInterfaceNumber, first.bInterfaceClass, first.bInterfaceSubClass, first.bInterfaceProtocol, {}
    };
    for (int e = 0; e < first.bNumEndpoints; ++e) {
      const libusb_endpoint_descriptor& endpoint = first.endpoint[e];
      interface.endpoints.push_back({endpoint.bEndpointAddress, endpointTypeOf(endpoint.bmAttributes),
                                     static_cast<std::uint16_t>(endpoint.wMaxPacketSize & 0x7ff)});
    }
    info.interfaces.push_back(std::move(interface));
  }
  libusb_free_config_descriptor(config);
  return info;
}

UsbError usbErrorOf(int code, const UsbDeviceInfo& info, const std::string& what) {
  const std::string device = describe(info) + ": ";
  switch (code) {
    case LIBUSB_ERROR_ACCESS:
      return {UsbCause::no_permission, device + "no permission to open it; install device/udev/" + kUdevRule +
                                           " (cmake --install does), then plug the device in again"};
    case LIBUSB_ERROR_BUSY:
      return {UsbCause::busy, device + what + ": another program is using it; end that one first"};
    case LIBUSB_ERROR_NO_DEVICE:
      return {UsbCause::gone, device + what + ": it has been unplugged"};
    case LIBUSB_ERROR_TIMEOUT:
      return {UsbCause::timed_out, device + what + ": it does not answer"};
    case LIBUSB_ERROR_PIPE:
      return {UsbCause::stalled, device + what + ": the device refused"};
    default:
      return {UsbCause::failed, device + what + ": " + libusb_strerror(code)};
  }
}

class LibusbConnection;

class LibusbTransfer : public UsbTransfer {
 public:
  LibusbTransfer(LibusbConnection& connection, libusb_device_handle* handle, const UsbEndpoint& endpoint,
                 std::size_t capacity)
      : connection_(connection), flight_(std::make_unique<Flight>(capacity)), transfer_(libusb_alloc_transfer(0)) {
    if (transfer_ == nullptr) throw std::bad_alloc();
    flight_->owner = this;
    std::uint8_t* const bytes = flight_->buffer.data();
    if (endpoint.type == UsbEndpointType::interrupt) {
      libusb_fill_interrupt_transfer(transfer_, handle, endpoint.address, bytes, 0, &onDone, flight_.get(), 0);
    } else {
      libusb_fill_bulk_transfer(transfer_, handle, endpoint.address, bytes, 0, &onDone, flight_.get(), 0);
    }
  }
  ~LibusbTransfer() override {
    if (LibusbTransfer::cancel(kCancelTime_s)) {
      libusb_free_transfer(transfer_);
    } else {
      // The system still uses the buffer; onDone() frees both if it returns.
      flight_->owner = nullptr;
      static_cast<void>(flight_.release());
    }
  }
  LibusbTransfer(const LibusbTransfer&) = delete;
  LibusbTransfer& operator=(const LibusbTransfer&) = delete;

  std::span<std::uint8_t> buffer() noexcept override { return flight_->buffer; }
  UsbStatus status() const noexcept override { return status_; }
  std::size_t actual() const noexcept override { return actual_; }
  bool submit(std::size_t length) noexcept override;
  bool cancel(double patience_s) noexcept override;

 private:
  struct Flight {  // used by the system while the transfer is pending; may outlive its owner
    explicit Flight(std::size_t capacity) : buffer(capacity) {}
    LibusbTransfer* owner = nullptr;
    std::vector<std::uint8_t> buffer;
  };
  static void LIBUSB_CALL onDone(libusb_transfer* transfer);

  LibusbConnection& connection_;
  std::unique_ptr<Flight> flight_;
  libusb_transfer* transfer_;
  std::size_t actual_ = 0;
  UsbStatus status_ = UsbStatus::idle;
};

class LibusbConnection : public UsbConnection {
 public:
  explicit LibusbConnection(const UsbDeviceInfo& wanted) : info_(wanted) {
    for (libusb_device* device : DeviceList(context_)) {
      const std::optional<UsbDeviceInfo> info = infoOf(device);
      if (!info || !info->samePlug(wanted)) continue;
      info_ = *info;
      const int error = libusb_open(device, &handle_);
      if (error == LIBUSB_ERROR_NO_DEVICE) break;
      if (error != 0) throw usbErrorOf(error, info_, "it cannot be opened");
      libusb_set_auto_detach_kernel_driver(handle_, 1);
      return;
    }
    throw UsbError(UsbCause::not_found, describe(wanted) + ": it is no longer plugged in there");
  }
  ~LibusbConnection() override {
    while (!claimed_.empty()) release(claimed_.back());
    libusb_close(handle_);
  }
  LibusbConnection(const LibusbConnection&) = delete;
  LibusbConnection& operator=(const LibusbConnection&) = delete;

  const UsbDeviceInfo& info() const noexcept override { return info_; }
  bool gone() const noexcept override { return gone_; }
  double time_s() const noexcept override { return monotonic_s(); }

  void claim(std::uint8_t interface) override {
    const int error = libusb_claim_interface(handle_, interface);
    if (error == LIBUSB_ERROR_NO_DEVICE) gone_ = true;
    if (error != 0) throw usbErrorOf(error, info_, "interface " + std::to_string(interface) + " cannot be claimed");
    if (std::find(claimed_.begin(), claimed_.end(), interface) == claimed_.end()) claimed_.push_back(interface);
  }

  void release(std::uint8_t interface) noexcept override {
    if (std::erase(claimed_, interface) > 0) libusb_release_interface(handle_, interface);
  }

  std::size_t control(const UsbSetup& setup, std::span<std::uint8_t> data, double timeout_s) override {
    if (data.size() > 0xffff) throw UsbError(UsbCause::failed, describe(info_) + ": a request of more than 64 KiB");
    const auto timeout_ms = static_cast<unsigned>(std::max(1.0, std::ceil(timeout_s * 1e3)));
    const int moved = libusb_control_transfer(handle_, setup.request_type, setup.request, setup.value, setup.index,
                                              data.data(), static_cast<std::uint16_t>(data.size()), timeout_ms);
    if (moved == LIBUSB_ERROR_NO_DEVICE) gone_ = true;
    if (moved < 0) throw usbErrorOf(moved, info_, "request " + std::to_string(setup.request));
    return static_cast<std::size_t>(moved);
  }

  std::unique_ptr<UsbTransfer> makeTransfer(std::uint8_t endpoint, std::size_t capacity) override {
    for (const UsbInterface& interface : info_.interfaces)
      for (const UsbEndpoint& e : interface.endpoints)
        if (e.address == endpoint && (e.type == UsbEndpointType::bulk || e.type == UsbEndpointType::interrupt))
          return std::make_unique<LibusbTransfer>(*this, handle_, e, capacity);
    throw UsbError(UsbCause::failed, describe(info_) + ": it has no bulk or interrupt endpoint " +
                                         std::to_string(endpoint & 0x7f) + (endpoint & 0x80 ? " IN" : " OUT"));
  }

  bool handleEvents(double timeout_s) noexcept override {
    const std::uint64_t before = completed_;
    const double end_s = monotonic_s() + timeout_s;
    for (double left_s = timeout_s;;) {
      timeval limit = timevalOf(left_s);
      libusb_handle_events_timeout_completed(context_.get(), &limit, nullptr);
      if (completed_ != before) return true;
      // It also returns on signals and on events that complete nothing.
      left_s = end_s - monotonic_s();
      if (left_s <= 0) return false;
    }
  }

 private:
  friend class LibusbTransfer;
  Context context_;
  UsbDeviceInfo info_;
  libusb_device_handle* handle_ = nullptr;
  std::vector<std::uint8_t> claimed_;
  std::uint64_t completed_ = 0;
  bool gone_ = false;
};

bool LibusbTransfer::submit(std::size_t length) noexcept {
  if (pending()) return false;
  actual_ = 0;
  transfer_->length = static_cast<int>(std::min(length, flight_->buffer.size()));
  const int error = libusb_submit_transfer(transfer_);
  status_ = error == 0 ? UsbStatus::pending : error == LIBUSB_ERROR_NO_DEVICE ? UsbStatus::gone : UsbStatus::failed;
  if (status_ == UsbStatus::gone) connection_.gone_ = true;
  return error == 0;
}

bool LibusbTransfer::cancel(double patience_s) noexcept {
  if (!pending()) return true;
  libusb_cancel_transfer(transfer_);
  connection_.handleEvents(0);
  return connection_.await(*this, patience_s);
}

void LibusbTransfer::onDone(libusb_transfer* transfer) {
  auto* const flight = static_cast<Flight*>(transfer->user_data);
  if (flight->owner == nullptr) {
    delete flight;
    libusb_free_transfer(transfer);
    return;
  }
  LibusbTransfer& self = *flight->owner;
  self.actual_ = static_cast<std::size_t>(std::max(transfer->actual_length, 0));
  switch (transfer->status) {
    case LIBUSB_TRANSFER_COMPLETED:
      self.status_ = UsbStatus::done;
      break;
    case LIBUSB_TRANSFER_TIMED_OUT:
      self.status_ = UsbStatus::timed_out;
      break;
    case LIBUSB_TRANSFER_CANCELLED:
      self.status_ = UsbStatus::cancelled;
      break;
    case LIBUSB_TRANSFER_STALL:
      self.status_ = UsbStatus::stalled;
      break;
    case LIBUSB_TRANSFER_OVERFLOW:
      self.status_ = UsbStatus::overflow;
      break;
    case LIBUSB_TRANSFER_NO_DEVICE:
      self.status_ = UsbStatus::gone;
      break;
    default:
      self.status_ = UsbStatus::failed;
      break;
  }
  if (self.status_ == UsbStatus::gone) self.connection_.gone_ = true;
  ++self.connection_.completed_;
}

class LibusbTransport : public UsbTransport {
 public:
  std::vector<UsbDeviceInfo> devices() override {
    const Context context;
    std::vector<UsbDeviceInfo> all;
    for (libusb_device* device : DeviceList(context))
      if (std::optional<UsbDeviceInfo> info = infoOf(device)) all.push_back(std::move(*info));
    std::sort(all.begin(), all.end(),
              [](const UsbDeviceInfo& a, const UsbDeviceInfo& b) { return a.bus_path < b.bus_path; });
    return all;
  }
  std::unique_ptr<UsbConnection> open(const UsbDeviceInfo& info) override {
    return std::make_unique<LibusbConnection>(info);
  }
  double time_s() const noexcept override { return monotonic_s(); }
  void pause(double seconds) noexcept override {
    std::this_thread::sleep_for(std::chrono::duration<double>(std::max(seconds, 0.0)));
  }
};

}  // namespace

UsbTransport& systemUsb() {
  static LibusbTransport transport;
  return transport;
}

}  // namespace filiform
