// Outbox: which PROXY frame may be sent now. At most 8 sent frames are unacknowledged; then one waits, and a newer
// frame replaces it. So a client that reads slowly gets the newest state, and holds no memory of the server. Thread
// rule: thread-compatible.
#pragma once

#include "tools/serve/session/protocol.h"

#include <cstdint>
#include <optional>

namespace filiform::tools {

class Outbox {
 public:
  // A newer frame. Replaces one that waits.
  void put(const v1::Proxy& proxy) {
    replaced_ += waiting_ ? 1 : 0;
    waiting_ = proxy;
  }
  // The client has received the frames up to this one. Numbers that were never sent, or are older, mean nothing.
  void acknowledge(std::uint32_t seq) {
    if (seq - acknowledged_ <= sent_ - acknowledged_) acknowledged_ = seq;  // modulo 2^32
  }
  bool maySend() const { return sent_ - acknowledged_ < v1::kMostUnacknowledged; }
  // The frame to send now, with its number; nullopt: none waits, or 8 are unacknowledged.
  std::optional<v1::Proxy> next() {
    if (!waiting_ || !maySend()) return std::nullopt;
    v1::Proxy proxy = *waiting_;
    waiting_.reset();
    proxy.seq = ++sent_;
    proxy.replaced = static_cast<std::uint16_t>(replaced_ < 65535 ? replaced_ : 65535);
    replaced_ = 0;
    return proxy;
  }
  std::uint32_t sent() const { return sent_; }

 private:
  std::optional<v1::Proxy> waiting_;
  std::uint32_t sent_ = 0, acknowledged_ = 0;
  std::uint64_t replaced_ = 0;
};

}  // namespace filiform::tools
