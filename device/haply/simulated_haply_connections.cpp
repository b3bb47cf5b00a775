#include "device/haply/internal/haply_peer.h"
#include "device/haply/simulated_haply.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace filiform {

namespace {

class VirtualStream : public ByteStream {
 public:
  VirtualStream(SimulatedHaply& service, double& now_s) : service_(service), peer_(service), now_s_(now_s) {}

  bool write(std::span<const char> bytes, double) noexcept override {
    const std::uint64_t before = service_.answers();
    if (ended_) return false;
    ended_ = !peer_.take(bytes, coming_);
    now_s_ += service_.options().period_s * static_cast<double>(service_.answers() - before);
    return true;
  }
  long read(std::span<char> into, double wait_s) noexcept override {
    if (coming_.empty() && !ended_) ended_ = !peer_.goOn(coming_);
    if (coming_.empty()) {
      if (ended_ || service_.faults().ends) return -1;
      now_s_ += wait_s;
      return 0;
    }
    const std::size_t part = std::min(into.size(), coming_.size());
    std::copy_n(coming_.begin(), part, into.begin());
    coming_.erase(0, part);
    return static_cast<long>(part);
  }
  void sleepUntil(double until_s) noexcept override { now_s_ = std::max(now_s_, until_s); }
  double time_s() const noexcept override { return now_s_; }

 private:
  SimulatedHaply& service_;
  internal::HaplyPeer peer_;
  double& now_s_;
  std::string coming_;
  bool ended_ = false;
};

}  // namespace

std::function<std::unique_ptr<ByteStream>()> SimulatedHaply::connections() {
  return [this] { return std::make_unique<VirtualStream>(*this, now_s()); };
}

}  // namespace filiform
