// SocketLife: pings the client of a WebSocket, watches its silence, and closes with a code. Included by the sockets
// alone, because it needs Boost.Beast. Thread rule: the thread of the server's io_context.
#pragma once

#include "tools/serve/session/silence.h"

#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>

namespace filiform::tools::internal {

class SocketLife {
 public:
  using Clock = std::chrono::steady_clock;
  using Stream = boost::beast::websocket::stream<boost::beast::tcp_stream>;

  explicit SocketLife(Stream& socket) : socket_(socket) {}

  static double now_s() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

  void accepted() {
    silence_ = Silence(now_s());
    accepted_ = true;
  }
  bool isAccepted() const { return accepted_; }
  void frameCame() { silence_.frameCame(now_s()); }
  void pongCame() { silence_.pongCame(now_s()); }

  // Every 50 ms or so. Sends a ping when it is time. Returns what the socket must do: `close`, `end` or `nothing`.
  // `owner` keeps this object alive.
  Silence::Due watch(const std::shared_ptr<void>& owner) {
    if (closing_) return Clock::now() - closing_since_ > kClosing ? Silence::Due::end : Silence::Due::nothing;
    const Silence::Due due = silence_.at(now_s());
    if (due != Silence::Due::ping) return due;
    if (accepted_ && !std::exchange(pinging_, true)) {
      silence_.pingSent(now_s());
      socket_.async_ping({}, [this, owner](boost::system::error_code) { pinging_ = false; });
    }
    return Silence::Due::nothing;
  }

  // True from the first call of beginClosing() or end() on.
  bool isClosing() const { return closing_; }
  // False: the socket closes already.
  bool beginClosing() {
    if (std::exchange(closing_, true)) return false;
    closing_since_ = Clock::now();
    return true;
  }
  // Sends the close frame, to which the client may answer for 10 s; then calls ended().
  template <typename Ended>
  void sendClose(unsigned code, const std::string& reason, const Ended& ended) {
    const boost::beast::websocket::close_reason why(static_cast<boost::beast::websocket::close_code>(code),
                                                    reason.substr(0, 120));
    socket_.async_close(why, [ended](boost::system::error_code) { ended(); });
  }

  // Notes the end. False: it was noted already.
  bool end() {
    closing_ = true;
    return !std::exchange(ended_, true);
  }
  bool hasEnded() const { return ended_; }
  double seconds() const { return std::chrono::duration<double>(Clock::now() - began_).count(); }

 private:
  static constexpr std::chrono::seconds kClosing{10};

  Stream& socket_;
  bool pinging_ = false, accepted_ = false, closing_ = false, ended_ = false;
  Clock::time_point began_ = Clock::now(), closing_since_;
  Silence silence_{now_s()};
};

}  // namespace filiform::tools::internal
