// DeskSocket: the WebSocket of a desk or of a page that looks on. Included by server.cpp alone, because it needs
// Boost.Beast. Thread rule: the thread of the server's io_context.
#pragma once

#include "tools/desk/desk_rooms.h"
#include "tools/session/silence.h"

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

namespace filiform::tools::internal {

class DeskSocket;

// What the sockets share.
struct DeskHall {
  DeskRooms rooms = {};
  std::function<void(const DeskSocket& socket)> log = {};  // at the end of a socket
  std::set<std::shared_ptr<DeskSocket>> sockets = {};
};

class DeskSocket : public std::enable_shared_from_this<DeskSocket> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;
  using ErrorCode = boost::system::error_code;

  DeskSocket(boost::beast::tcp_stream stream, DeskHall& hall, DeskRoomName room, std::string client_address,
             std::string target)
      : client_address_(std::move(client_address)),
        target_(std::move(target)),
        room_(std::move(room)),
        hall_(hall),
        socket_(std::move(stream)) {}

  // Answers the upgrade, then enters the room, or says why not.
  void begin(const Request& request, DeskMember::Role role, const std::optional<DeskRefusal>& refused) {
    namespace websocket = boost::beast::websocket;
    boost::beast::get_lowest_layer(socket_).expires_never();
    ErrorCode ignored;  // without it, a client that reads slowly would get places that are minutes old
    boost::beast::get_lowest_layer(socket_).socket().set_option(boost::asio::socket_base::send_buffer_size(kUnread),
                                                                ignored);
    socket_.set_option(
        websocket::stream_base::timeout{websocket::stream_base::none(), websocket::stream_base::none(), false});
    socket_.control_callback([this](websocket::frame_type kind, boost::beast::string_view) {
      if (kind == websocket::frame_type::pong) silence_.pongCame(now_s());
    });
    socket_.read_message_max(DeskPlace::kMostBytes);
    socket_.set_option(websocket::stream_base::decorator(
        [](websocket::response_type& response) { response.set(boost::beast::http::field::server, "filiform"); }));
    request_ = request;
    socket_.async_accept(request_, [self = shared_from_this(), role, refused](ErrorCode error) {
      if (error) return self->end();
      self->silence_ = Silence(now_s());
      self->accepted_ = true;
      self->socket_.text(true);
      if (refused) return self->close(*refused);
      if (!self->ended_) self->enter(role);
    });
  }

  // Every 50 ms or so: pings, and the client's silence. Only pages may say nothing.
  void watch() {
    if (closing_) {
      if (Clock::now() - closing_since_ > kClosing) end();
      return;
    }
    switch (silence_.at(now_s())) {
      case Silence::Due::end:
        return end();
      case Silence::Due::close:
        silence_.frameCame(now_s());
        break;
      case Silence::Due::ping:
        if (!accepted_ || std::exchange(pinging_, true)) break;
        silence_.pingSent(now_s());
        socket_.async_ping({}, [self = shared_from_this()](ErrorCode) { self->pinging_ = false; });
        break;
      case Silence::Due::nothing:
        break;
    }
  }

  // Closes the WebSocket with a code; the client may answer for kClosing.
  void close(const DeskRefusal& why) {
    if (std::exchange(closing_, true)) return;
    closing_since_ = Clock::now();
    leave();
    if (!accepted_) return end();
    const boost::beast::websocket::close_reason reason(static_cast<boost::beast::websocket::close_code>(why.code),
                                                       why.reason.substr(0, 120));
    socket_.async_close(reason, [self = shared_from_this()](ErrorCode) { self->end(); });
  }

  // Ends at once.
  void end() {
    closing_ = true;
    if (std::exchange(ended_, true)) return;
    leave();
    boost::beast::get_lowest_layer(socket_).close();
    if (hall_.log) hall_.log(*this);
    hall_.sockets.erase(shared_from_this());
  }

  const std::string& clientAddress() const { return client_address_; }
  const std::string& target() const { return target_; }
  std::uint64_t sentBytes() const { return sent_bytes_; }
  std::uint64_t receivedBytes() const { return received_bytes_; }
  double seconds() const { return std::chrono::duration<double>(Clock::now() - began_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  static double now_s() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }
  static constexpr int kUnread = 4096;                 // bytes that the system keeps for a client that does not read
  static constexpr std::chrono::seconds kClosing{10};  // for the client's answer to a close frame

  void enter(DeskMember::Role role) {
    member_ = std::make_shared<DeskMember>(
        role, [this] { pump(); }, [this](const DeskRefusal& why) { close(why); });
    if (const auto refused = hall_.rooms.enter(member_, room_, now_s())) return close(*refused);
    read();
  }

  // The member may still have callbacks to this object.
  void leave() {
    if (const auto member = std::exchange(member_, nullptr)) hall_.rooms.leave(member);
  }

  // Sends the newest news. One message at a time: a client that reads slowly misses the older ones.
  void pump() {
    if (writing_ || closing_ || member_ == nullptr) return;
    std::optional<std::string> news = member_->takeNews();
    if (!news) return;
    writing_ = true;
    out_ = std::move(*news);
    socket_.async_write(boost::asio::buffer(out_), [self = shared_from_this()](ErrorCode error, std::size_t bytes) {
      self->writing_ = false;
      self->sent_bytes_ += bytes;
      if (error) return self->end();
      self->pump();
    });
  }

  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](ErrorCode error, std::size_t bytes) {
      self->received_bytes_ += bytes;
      if (error) {
        if (!self->closing_) self->end();  // else async_close ends it
        return;
      }
      if (self->closing_) return;
      self->silence_.frameCame(now_s());
      const auto data = self->buffer_.data();
      const std::string_view text(static_cast<const char*>(data.data()), data.size());
      const auto refused = self->socket_.got_text() ? self->hall_.rooms.receive(self->member_, text, now_s())
                                                    : DeskRefusal{DeskCode::policy, "a place is a text, not binary"};
      self->buffer_.consume(self->buffer_.size());
      if (refused) return self->close(*refused);
      self->read();
    });
  }

  const std::string client_address_, target_;
  const DeskRoomName room_;
  DeskHall& hall_;
  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  std::shared_ptr<DeskMember> member_;  // while it is in the room
  Request request_;
  boost::beast::flat_buffer buffer_;
  std::string out_;
  bool writing_ = false, pinging_ = false, accepted_ = false, closing_ = false, ended_ = false;
  std::uint64_t sent_bytes_ = 0, received_bytes_ = 0;
  Clock::time_point began_ = Clock::now(), closing_since_;
  Silence silence_{now_s()};
};

}  // namespace filiform::tools::internal
