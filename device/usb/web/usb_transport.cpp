// systemUsb() by WebHID: the 3D mouse that the page has opened. Stands in for libusb_transport.cpp in the preset `web`.
//
// The page tells when its mouse comes and leaves, and hands over each report, with its id first. The reports wait in a
// ring between the page's thread and the haptic one. If the ring is full, a report is lost: the next one has the newest
// rates.
#include "device/usb/usb_transport.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <emscripten.h>
#include <mutex>
#include <thread>

namespace filiform {

namespace {

constexpr std::uint8_t kReads = 0x81;  // address of the only endpoint
constexpr std::size_t kMostBytes = 64;

double monotonic_s() noexcept {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// One thread puts, one takes.
class ReportRing {
 public:
  void put(const std::uint8_t* bytes, std::size_t count) noexcept {
    const unsigned end = end_.load(std::memory_order_relaxed);
    if (end - begin_.load(std::memory_order_acquire) == reports_.size()) return;
    Report& report = reports_[end % reports_.size()];
    report.count = std::min(count, report.bytes.size());
    std::memcpy(report.bytes.data(), bytes, report.count);
    end_.store(end + 1, std::memory_order_release);
  }
  // Returns the number of bytes; 0: there is no report.
  std::size_t take(std::span<std::uint8_t> to) noexcept {
    const unsigned begin = begin_.load(std::memory_order_relaxed);
    if (begin == end_.load(std::memory_order_acquire)) return 0;
    const Report& report = reports_[begin % reports_.size()];
    const std::size_t count = std::min(report.count, to.size());
    std::memcpy(to.data(), report.bytes.data(), count);
    begin_.store(begin + 1, std::memory_order_release);
    return count;
  }

 private:
  struct Report {
    std::array<std::uint8_t, kMostBytes> bytes;
    std::size_t count;
  };
  std::array<Report, 64> reports_{};
  std::atomic<unsigned> begin_{0}, end_{0};
};

// The mouse of the page.
struct Plug {
  std::mutex mutex;
  UsbDeviceInfo info;                // guarded by the mutex
  std::atomic<unsigned> plugged{0};  // counts up each time the mouse comes or leaves; odd: it is there
  ReportRing reports;
};

Plug& plug() {
  static Plug the_plug;
  return the_plug;
}

class HidTransfer final : public UsbTransfer {
 public:
  HidTransfer(std::size_t capacity, unsigned plugged) : bytes_(capacity), plugged_(plugged) {}
  std::span<std::uint8_t> buffer() noexcept override { return bytes_; }
  UsbStatus status() const noexcept override { return status_; }
  std::size_t actual() const noexcept override { return actual_; }
  bool submit(std::size_t) noexcept override {
    actual_ = 0;
    status_ = plug().plugged == plugged_ ? UsbStatus::pending : UsbStatus::gone;
    return pending();
  }
  bool cancel(double) noexcept override {
    if (pending()) status_ = UsbStatus::cancelled;
    return true;
  }
  void serve() noexcept {
    if (!pending()) return;
    if (plug().plugged != plugged_) {
      status_ = UsbStatus::gone;
    } else if (const std::size_t count = plug().reports.take(bytes_); count > 0) {
      actual_ = count;
      status_ = UsbStatus::done;
    }
  }

 private:
  std::vector<std::uint8_t> bytes_;
  unsigned plugged_;
  UsbStatus status_ = UsbStatus::idle;
  std::size_t actual_ = 0;
};

class HidConnection final : public UsbConnection {
 public:
  HidConnection(UsbDeviceInfo info, unsigned plugged) : info_(std::move(info)), plugged_(plugged) {}
  const UsbDeviceInfo& info() const noexcept override { return info_; }
  void claim(std::uint8_t) override {}
  void release(std::uint8_t) noexcept override {}
  // Of HID's requests only SET_REPORT, for an output report; it is sent later.
  std::size_t control(const UsbSetup& setup, std::span<std::uint8_t> data, double) override {
    if (setup.request != 9 || data.size() != 2)
      throw UsbError(UsbCause::failed, describe(info_) + ": the browser allows no such request");
    MAIN_THREAD_ASYNC_EM_ASM({ Module.sendReport($0, $1); }, data[0], data[1]);
    return data.size();
  }
  std::unique_ptr<UsbTransfer> makeTransfer(std::uint8_t endpoint, std::size_t capacity) override {
    if (endpoint != kReads || transfer_ != nullptr)
      throw UsbError(UsbCause::failed, describe(info_) + ": it has one endpoint, for reading");
    auto transfer = std::make_unique<HidTransfer>(capacity, plugged_);
    transfer_ = transfer.get();
    return transfer;
  }
  bool handleEvents(double timeout_s) noexcept override {
    const double end_s = monotonic_s() + timeout_s;
    do {
      if (transfer_ != nullptr) transfer_->serve();
      if (transfer_ != nullptr && !transfer_->pending()) return true;
      if (timeout_s > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    } while (monotonic_s() < end_s);
    return false;
  }
  bool gone() const noexcept override { return plug().plugged != plugged_; }
  double time_s() const noexcept override { return monotonic_s(); }

 private:
  UsbDeviceInfo info_;
  unsigned plugged_;
  HidTransfer* transfer_ = nullptr;  // outlives no use: its owner ends it last
};

class HidTransport final : public UsbTransport {
 public:
  std::vector<UsbDeviceInfo> devices() override {
    const std::lock_guard lock(plug().mutex);
    if (plug().plugged % 2 == 0) return {};
    return {plug().info};
  }
  std::unique_ptr<UsbConnection> open(const UsbDeviceInfo& info) override {
    const std::lock_guard lock(plug().mutex);
    const unsigned plugged = plug().plugged;
    if (plugged % 2 == 0 || !plug().info.samePlug(info))
      throw UsbError(UsbCause::not_found, describe(info) + ": it is no longer plugged in there");
    std::array<std::uint8_t, kMostBytes> old;
    while (plug().reports.take(old) > 0) {
    }
    return std::make_unique<HidConnection>(plug().info, plugged);
  }
  double time_s() const noexcept override { return monotonic_s(); }
  void pause(double seconds) noexcept override {
    std::this_thread::sleep_for(std::chrono::duration<double>(std::max(seconds, 0.0)));
  }
};

}  // namespace

UsbTransport& systemUsb() {
  static HidTransport transport;
  return transport;
}

}  // namespace filiform

// The page calls these, on its own thread.
extern "C" {

EMSCRIPTEN_KEEPALIVE void filiform_mouse_comes(int vendor, int product, const char* name) {
  filiform::Plug& plug = filiform::plug();
  const std::lock_guard lock(plug.mutex);
  if (plug.plugged % 2 != 0) ++plug.plugged;
  filiform::UsbDeviceInfo& info = plug.info;
  info.vendor = static_cast<std::uint16_t>(vendor);
  info.product = static_cast<std::uint16_t>(product);
  info.bus_path = "browser";
  ++info.address;
  info.product_name = name;
  info.interfaces = {{0, 3, 0, 0, {{filiform::kReads, filiform::UsbEndpointType::interrupt, 64}}}};
  ++plug.plugged;
}

EMSCRIPTEN_KEEPALIVE void filiform_mouse_leaves() {
  filiform::Plug& plug = filiform::plug();
  const std::lock_guard lock(plug.mutex);
  if (plug.plugged % 2 != 0) ++plug.plugged;
}

EMSCRIPTEN_KEEPALIVE void filiform_mouse_reports(const std::uint8_t* bytes, int count) {
  if (count > 0) filiform::plug().reports.put(bytes, static_cast<std::size_t>(count));
}
}
