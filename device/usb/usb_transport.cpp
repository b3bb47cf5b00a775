#include "device/usb/usb_transport.h"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace filiform {

const char* toString(UsbStatus status) {
  switch (status) {
    case UsbStatus::idle:
      return "idle";
    case UsbStatus::pending:
      return "pending";
    case UsbStatus::done:
      return "done";
    case UsbStatus::timed_out:
      return "timed out";
    case UsbStatus::cancelled:
      return "cancelled";
    case UsbStatus::stalled:
      return "stalled";
    case UsbStatus::overflow:
      return "overflow";
    case UsbStatus::gone:
      return "gone";
    case UsbStatus::failed:
      return "failed";
  }
  return "unknown";
}

bool UsbDeviceInfo::samePlug(const UsbDeviceInfo& other) const {
  return bus_path == other.bus_path && address == other.address && vendor == other.vendor && product == other.product;
}

std::string describe(const UsbDeviceInfo& info) {
  char ids[16];
  std::snprintf(ids, sizeof ids, " %04x:%04x", info.vendor, info.product);
  return info.bus_path + ids + (info.product_name.empty() ? "" : " " + info.product_name);
}

UsbStatus UsbConnection::run(UsbTransfer& transfer, std::size_t length, double timeout_s, double cancel_s) noexcept {
  if (!transfer.submit(length)) return transfer.status();
  if (await(transfer, timeout_s)) return transfer.status();
  transfer.cancel(cancel_s);
  return transfer.status() == UsbStatus::cancelled ? UsbStatus::timed_out : transfer.status();
}

bool UsbConnection::await(const UsbTransfer& transfer, double patience_s) noexcept {
  const double end_s = time_s() + patience_s;
  for (double left_s = patience_s; transfer.pending() && left_s > 0; left_s = end_s - time_s()) handleEvents(left_s);
  return !transfer.pending();
}

std::vector<UsbChange> UsbWatch::poll() {
  std::vector<UsbDeviceInfo> now = transport_.devices();
  std::vector<UsbChange> changes;
  const auto missingFrom = [](const std::vector<UsbDeviceInfo>& list, const UsbDeviceInfo& device) {
    return std::none_of(list.begin(), list.end(), [&device](const UsbDeviceInfo& d) { return d.samePlug(device); });
  };
  for (const UsbDeviceInfo& device : known_)
    if (missingFrom(now, device)) changes.push_back({false, device});
  for (const UsbDeviceInfo& device : now)
    if (missingFrom(known_, device)) changes.push_back({true, device});
  known_ = std::move(now);
  return changes;
}

}  // namespace filiform
