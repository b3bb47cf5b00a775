#include "tests/support/devices/fake_usb.h"

#include <algorithm>
#include <cstring>

namespace filiform::test {

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

template <typename T>
bool contains(const std::vector<T>& list, const T& value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

}  // namespace

class FakeTransfer;

class FakeConnection : public UsbConnection {
 public:
  FakeConnection(FakeUsb& usb, FakeUsbDevice& device) : usb_(usb), device_(device) { pending_.reserve(64); }
  ~FakeConnection() override {
    if (transfers_ != 0) usb_.violations_.push_back("a transfer outlived its connection");
    while (!claimed_.empty()) release(claimed_.back());
  }

  const UsbDeviceInfo& info() const noexcept override { return device_.info; }
  bool gone() const noexcept override { return gone_; }
  double time_s() const noexcept override { return usb_.time_s(); }

  void claim(std::uint8_t interface) override {
    if (!device_.plugged_) throw lost();
    const auto& all = device_.info.interfaces;
    if (std::none_of(all.begin(), all.end(), [interface](const UsbInterface& i) { return i.number == interface; }))
      throw UsbError(UsbCause::failed, describe(info()) + ": no interface " + std::to_string(interface));
    if (contains(claimed_, interface)) return;
    if (contains(device_.busy, interface) || contains(device_.claimed_, interface))
      throw UsbError(UsbCause::busy, describe(info()) + ": another program has it");
    if (std::erase(device_.kernel_driven, interface) > 0) device_.detached_.push_back(interface);
    claimed_.push_back(interface);
    device_.claimed_.push_back(interface);
  }

  void release(std::uint8_t interface) noexcept override {
    if (std::erase(claimed_, interface) == 0) return;
    std::erase(device_.claimed_, interface);
    if (std::erase(device_.detached_, interface) > 0) device_.kernel_driven.push_back(interface);
  }

  std::size_t control(const UsbSetup& setup, std::span<std::uint8_t> data, double timeout_s) override {
    if (device_.reached(FakeUsbFault::Kind::deaf, device_.transfers_)) {
      usb_.advanceTo(usb_.time_s_ + timeout_s);
      throw UsbError(UsbCause::timed_out, describe(info()) + ": it does not answer");
    }
    // Meanwhile other transfers complete, as with libusb.
    const double end_s = usb_.time_s_ + device_.control_s;
    do handleEvents(end_s - usb_.time_s_);
    while (usb_.time_s_ < end_s && device_.plugged_);
    if (!device_.plugged_) throw lost();
    if (!device_.on_control) return data.size();
    const std::optional<std::size_t> moved = device_.on_control(setup, data, device_);
    if (!moved) throw UsbError(UsbCause::stalled, describe(info()) + ": it refused a request");
    return *moved;
  }

  std::unique_ptr<UsbTransfer> makeTransfer(std::uint8_t endpoint, std::size_t capacity) override;
  bool handleEvents(double timeout_s) noexcept override;

 private:
  friend class FakeTransfer;
  UsbError lost() {
    gone_ = true;
    return {UsbCause::gone, describe(info()) + ": it was unplugged"};
  }

  FakeUsb& usb_;
  FakeUsbDevice& device_;
  std::vector<FakeTransfer*> pending_;  // in the order of submission
  std::vector<std::uint8_t> claimed_;
  std::size_t transfers_ = 0;
  bool gone_ = false;
};

class FakeTransfer : public UsbTransfer {
 public:
  FakeTransfer(FakeConnection& connection, UsbEndpoint endpoint, std::uint8_t interface, std::size_t capacity)
      : connection_(connection), endpoint_(endpoint), interface_(interface), buffer_(capacity), in_flight_(capacity) {
    ++connection_.transfers_;
  }
  ~FakeTransfer() override {
    if (!FakeTransfer::cancel(0)) finish(UsbStatus::cancelled);
    --connection_.transfers_;
  }

  std::span<std::uint8_t> buffer() noexcept override {
    if (pending()) complain("a buffer was asked for in flight");
    return buffer_;
  }
  UsbStatus status() const noexcept override { return status_; }
  std::size_t actual() const noexcept override { return actual_; }

  bool submit(std::size_t length) noexcept override {
    FakeUsbDevice& device = connection_.device_;
    actual_ = 0;
    if (pending()) {
      complain("a transfer was submitted while pending");
      return false;
    }
    if (length > buffer_.size()) complain("a transfer was submitted with too great a length");
    if (!contains(connection_.claimed_, interface_)) {
      complain("a transfer was submitted over an interface that is not claimed");
      status_ = UsbStatus::failed;
      return false;
    }
    const std::uint64_t index = device.transfers_++;
    if (device.plugged_ && device.faultNow(FakeUsbFault::Kind::unplugged, index)) connection_.usb_.unplug(device);
    if (!device.plugged_) {
      status_ = UsbStatus::gone;
      connection_.gone_ = true;
      return false;
    }
    length_ = std::min(length, buffer_.size());
    due_s_ = endpoint_.in() ? kNever : connection_.usb_.time_s() + device.write_s;
    outcome_ = UsbStatus::done;
    stuck_ = device.reached(FakeUsbFault::Kind::stuck, index);
    if (stuck_ || device.reached(FakeUsbFault::Kind::deaf, index)) {
      outcome_ = UsbStatus::pending;
      due_s_ = kNever;
    } else if (device.faultNow(FakeUsbFault::Kind::stalled, index)) {
      outcome_ = UsbStatus::stalled;
      due_s_ = connection_.usb_.time_s();
    } else if (device.faultNow(FakeUsbFault::Kind::failed, index)) {
      outcome_ = UsbStatus::failed;
      due_s_ = connection_.usb_.time_s();
    }
    if (!endpoint_.in()) std::memcpy(in_flight_.data(), buffer_.data(), length_);
    status_ = UsbStatus::pending;
    connection_.pending_.push_back(this);
    if (endpoint_.in() && device.queues_.at(endpoint_.address).count == 0 && device.on_read)
      device.on_read(endpoint_.address, device);
    return true;
  }

  bool cancel(double patience_s) noexcept override {
    if (!pending()) return true;
    if (dueTime() <= connection_.usb_.time_s()) {
      complete();
    } else if (stuck_) {
      return connection_.await(*this, patience_s);
    } else {
      finish(UsbStatus::cancelled);
    }
    return true;
  }

  // The time of completion, as far as known now.
  double dueTime() const noexcept {
    if (outcome_ != UsbStatus::done || !endpoint_.in()) return due_s_;
    FakeUsbDevice::Queue& queue = connection_.device_.queues_.at(endpoint_.address);
    std::size_t before = 0;
    for (const FakeTransfer* other : connection_.pending_) {
      if (other == this) break;
      before += other->endpoint_.address == endpoint_.address ? 1 : 0;
    }
    const std::size_t ready = queue.count - (queue.joins_next ? 1 : 0);
    return before < ready ? queue.at(before).due_s : kNever;
  }

  void complete() noexcept {
    if (outcome_ != UsbStatus::done) return finish(outcome_);
    FakeUsbDevice& device = connection_.device_;
    if (!endpoint_.in()) {
      if (std::memcmp(in_flight_.data(), buffer_.data(), length_) != 0) complain("a buffer was changed in flight");
      actual_ = length_;
      finish(UsbStatus::done);
      if (device.on_write) device.on_write(endpoint_.address, {in_flight_.data(), length_}, device);
      return;
    }
    FakeUsbDevice::Queue& queue = device.queues_.at(endpoint_.address);
    const FakeUsbDevice::Packet& packet = queue.at(0);
    actual_ = std::min(packet.size, length_);
    std::memcpy(buffer_.data(), packet.bytes.data(), actual_);
    const bool too_long = packet.size > length_;
    queue.first = (queue.first + 1) % queue.ring.size();
    --queue.count;
    finish(too_long ? UsbStatus::overflow : UsbStatus::done);
  }

  void finish(UsbStatus status) noexcept {
    std::erase(connection_.pending_, this);
    status_ = status;
  }

 private:
  void complain(const char* what) const { connection_.usb_.violations_.push_back(what); }

  FakeConnection& connection_;
  UsbEndpoint endpoint_;
  std::uint8_t interface_;
  std::vector<std::uint8_t> buffer_, in_flight_;
  std::size_t length_ = 0, actual_ = 0;
  UsbStatus status_ = UsbStatus::idle, outcome_ = UsbStatus::done;
  double due_s_ = kNever;
  bool stuck_ = false;
};

std::unique_ptr<UsbTransfer> FakeConnection::makeTransfer(std::uint8_t endpoint, std::size_t capacity) {
  for (const UsbInterface& interface : device_.info.interfaces)
    for (const UsbEndpoint& e : interface.endpoints)
      if (e.address == endpoint && (e.type == UsbEndpointType::bulk || e.type == UsbEndpointType::interrupt))
        return std::make_unique<FakeTransfer>(*this, e, interface.number, capacity);
  throw UsbError(UsbCause::failed, describe(info()) + ": no such endpoint");
}

bool FakeConnection::handleEvents(double timeout_s) noexcept {
  double until_s = usb_.time_s_ + std::max(timeout_s, 0.0);
  for (const FakeTransfer* transfer : pending_) until_s = std::min(until_s, transfer->dueTime());
  for (const auto& [time_s, device] : usb_.unplugs_)
    if (device == &device_) until_s = std::min(until_s, time_s);
  usb_.advanceTo(until_s);
  if (!device_.plugged_) {
    gone_ = true;
    const bool any = !pending_.empty();
    while (!pending_.empty()) pending_.front()->finish(UsbStatus::gone);
    return any;
  }
  // Packets that a script sends during this call are for the next call.
  bool any = false;
  for (std::size_t left = pending_.size(), i = 0; left > 0; --left) {
    if (pending_[i]->dueTime() <= usb_.time_s_) {
      pending_[i]->complete();
      any = true;
    } else {
      ++i;
    }
  }
  return any;
}

FakeUsbDevice::FakeUsbDevice(FakeUsb& usb, UsbDeviceInfo what) : info(std::move(what)), usb_(usb) {
  for (const UsbInterface& interface : info.interfaces)
    for (const UsbEndpoint& endpoint : interface.endpoints)
      if (endpoint.in()) queues_[endpoint.address].ring.resize(usb.queue_packets);
}

double FakeUsbDevice::time_s() const noexcept { return usb_.time_s(); }

bool FakeUsbDevice::faultNow(FakeUsbFault::Kind kind, std::uint64_t index, FakeUsbFault* found) const {
  for (const FakeUsbFault& fault : faults_) {
    if (fault.kind != kind || fault.at != index) continue;
    if (found != nullptr) *found = fault;
    return true;
  }
  return false;
}

bool FakeUsbDevice::reached(FakeUsbFault::Kind kind, std::uint64_t index) const {
  return std::any_of(faults_.begin(), faults_.end(),
                     [=](const FakeUsbFault& fault) { return fault.kind == kind && fault.at <= index; });
}

void FakeUsbDevice::push(Queue& queue, std::span<const std::uint8_t> bytes, double due_s) {
  if (queue.joins_next) {
    Packet& last = queue.at(queue.count - 1);
    const std::size_t more = std::min(bytes.size(), kMaxPacket - last.size);
    std::copy_n(bytes.begin(), more, last.bytes.begin() + static_cast<std::ptrdiff_t>(last.size));
    last.size += more;
    last.due_s = std::max(last.due_s, due_s);
    queue.joins_next = false;
    return;
  }
  if (queue.count == queue.ring.size()) {
    ++lost_;
    return;
  }
  Packet& packet = queue.at(queue.count);
  if (queue.count > 0) due_s = std::max(due_s, queue.at(queue.count - 1).due_s);
  ++queue.count;
  packet.size = bytes.size();
  packet.due_s = due_s;
  std::copy(bytes.begin(), bytes.end(), packet.bytes.begin());
}

void FakeUsbDevice::answer(std::uint8_t endpoint, std::span<const std::uint8_t> bytes, double delay_s) {
  Queue& queue = queues_.at(endpoint);
  const double due_s = time_s() + delay_s;
  while (bytes.size() > kMaxPacket) {
    answer(endpoint, bytes.first(kMaxPacket), delay_s);
    bytes = bytes.subspan(kMaxPacket);
  }
  const std::uint64_t index = packets_++;
  FakeUsbFault fault;
  if (reached(FakeUsbFault::Kind::silent, index) || faultNow(FakeUsbFault::Kind::lost, index)) return;
  if (faultNow(FakeUsbFault::Kind::garbage, index, &fault)) {
    std::mt19937_64 random(fault.seed);
    std::array<std::uint8_t, kMaxPacket> noise{};
    for (std::size_t i = 0; i < bytes.size(); ++i) noise[i] = static_cast<std::uint8_t>(random());
    push(queue, {noise.data(), bytes.size()}, due_s);
  } else if (faultNow(FakeUsbFault::Kind::truncated, index, &fault)) {
    push(queue, bytes.first(std::min(fault.bytes, bytes.size())), due_s);
  } else if (faultNow(FakeUsbFault::Kind::split, index, &fault)) {
    const std::size_t first = std::min(fault.bytes, bytes.size());
    push(queue, bytes.first(first), due_s);
    push(queue, bytes.subspan(first), due_s);
  } else {
    const bool merges = faultNow(FakeUsbFault::Kind::merged, index) && queue.count < queue.ring.size();
    push(queue, bytes, due_s);
    queue.joins_next = merges;
  }
}

void FakeUsbDevice::purge() {
  for (auto& [endpoint, queue] : queues_) {
    queue.count = 0;
    queue.joins_next = false;
  }
}

FakeUsb::FakeUsb() = default;
FakeUsb::~FakeUsb() = default;

FakeUsbDevice& FakeUsb::plug(const UsbDeviceInfo& info) {
  devices_.push_back(std::unique_ptr<FakeUsbDevice>(new FakeUsbDevice(*this, info)));
  FakeUsbDevice& device = *devices_.back();
  if (device.info.address == 0) device.info.address = next_address_++;
  return device;
}

void FakeUsb::unplug(FakeUsbDevice& device) { device.plugged_ = false; }

void FakeUsb::unplugAt(FakeUsbDevice& device, double time_s) { unplugs_.emplace_back(time_s, &device); }

std::vector<UsbDeviceInfo> FakeUsb::devices() {
  std::vector<UsbDeviceInfo> all;
  for (const auto& device : devices_) {
    if (!device->plugged_) continue;
    all.push_back(device->info);
    all.back().may_open = device->permitted;
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const UsbDeviceInfo& a, const UsbDeviceInfo& b) { return a.bus_path < b.bus_path; });
  return all;
}

std::unique_ptr<UsbConnection> FakeUsb::open(const UsbDeviceInfo& info) {
  for (const auto& device : devices_) {
    if (!device->plugged_ || !device->info.samePlug(info)) continue;
    if (!device->permitted)
      throw UsbError(UsbCause::no_permission, describe(info) + ": no permission; install " + kUdevRule);
    return std::make_unique<FakeConnection>(*this, *device);
  }
  throw UsbError(UsbCause::not_found, describe(info) + ": it is no longer plugged in");
}

void FakeUsb::pause(double seconds) noexcept { advanceTo(time_s_ + std::max(seconds, 0.0)); }

void FakeUsb::advanceTo(double time_s) noexcept {
  time_s_ = std::max(time_s_, time_s);
  for (const auto& [at_s, device] : unplugs_)
    if (at_s <= time_s_) device->plugged_ = false;
  std::erase_if(unplugs_, [this](const auto& unplug) { return unplug.first <= time_s_; });
}

UsbDeviceInfo fakeBulkDevice(std::uint16_t vendor, std::uint16_t product, const std::string& bus_path,
                             const std::string& name) {
  UsbDeviceInfo info;
  info.vendor = vendor;
  info.product = product;
  info.bus_path = bus_path;
  info.product_name = name;
  info.interfaces = {{0, 0xff, 0xff, 0xff, {{0x81, UsbEndpointType::bulk, 64}, {0x02, UsbEndpointType::bulk, 64}}}};
  return info;
}

}  // namespace filiform::test
