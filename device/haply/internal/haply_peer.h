// HaplyPeer: the service's side of one connection, of a simulated service: HTTP, the WebSocket and its messages. Bytes
// go in, bytes come out. Thread rule: one thread.
#pragma once

#include "device/haply/simulated_haply.h"
#include "device/web_socket/frames.h"

#include <span>
#include <string>

namespace filiform::internal {

class HaplyPeer {
 public:
  explicit HaplyPeer(SimulatedHaply& service) : service_(service) {}
  ~HaplyPeer();
  HaplyPeer(const HaplyPeer&) = delete;
  HaplyPeer& operator=(const HaplyPeer&) = delete;

  // Takes bytes of the client, and appends what is sent back to `out`. Returns false if the connection ends after that.
  bool take(std::span<const char> bytes, std::string& out);
  // Answers messages that were held back. Returns as take().
  bool goOn(std::string& out);

 private:
  bool takeHead(std::string& out);
  void put(std::string_view payload, FrameKind kind, std::string& out);

  SimulatedHaply& service_;
  std::string head_;
  FrameParser parser_{16 * 1024, true};
  bool is_open_ = false;  // the WebSocket
};

}  // namespace filiform::internal
