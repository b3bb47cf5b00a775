// DeskSocket: the WebSocket of a desk or of a page that looks on. Included by server.cpp alone, because it needs
// Boost.Beast. Thread rule: the thread of the server's io_context.
#pragma once

#include "tools/serve/desk/desk_rooms.h"
#include "tools/serve/http/internal/socket_life.h"

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
      if (kind == websocket::frame_type::pong) life_.pongCame();
    });
    socket_.read_message_max(DeskPlace::kMostBytes);
    socket_.set_option(websocket::stream_base::decorator(
        [](websocket::response_type& response) { response.set(boost::beast::http::field::server, "filiform"); }));
    request_ = request;
    socket_.async_accept(request_, [self = shared_from_this(), role, refused](ErrorCode error) {
      if (error) return self->end();
      self->life_.accepted();
      self->socket_.text(true);
      if (refused) return self->close(*refused);
      if (!self->life_.hasEnded()) self->enter(role);
    });
  }

  // Every 50 ms or so: pings, and the client's silence. Only pages may say nothing.
  void watch() {
    const Silence::Due due = life_.watch(shared_from_this());
    if (due == Silence::Due::end) end();
    if (due == Silence::Due::close) life_.frameCame();
  }

  // Closes the WebSocket with a code; the client may answer for kClosing.
  void close(const DeskRefusal& why) {
    if (!life_.beginClosing()) return;
    leave();
    if (!life_.isAccepted()) return end();
    life_.sendClose(static_cast<unsigned>(why.code), why.reason, [self = shared_from_this()] { self->end(); });
  }

  // Ends at once.
  void end() {
    if (!life_.end()) return;
    leave();
    boost::beast::get_lowest_layer(socket_).close();
    if (hall_.log) hall_.log(*this);
    hall_.sockets.erase(shared_from_this());
  }

  const std::string& clientAddress() const { return client_address_; }
  const std::string& target() const { return target_; }
  std::uint64_t sentBytes() const { return sent_bytes_; }
  std::uint64_t receivedBytes() const { return received_bytes_; }
  double seconds() const { return life_.seconds(); }

 private:
  static constexpr int kUnread = 4096;  // bytes that the system keeps for a client that does not read

  void enter(DeskMember::Role role) {
    member_ = std::make_shared<DeskMember>(
        role, [this] { pump(); }, [this](const DeskRefusal& why) { close(why); });
    if (const auto refused = hall_.rooms.enter(member_, room_, SocketLife::now_s())) return close(*refused);
    read();
  }

  // The member may still have callbacks to this object.
  void leave() {
    if (const auto member = std::exchange(member_, nullptr)) hall_.rooms.leave(member);
  }

  // Sends the newest news. One message at a time: a client that reads slowly misses the older ones.
  void pump() {
    if (writing_ || life_.isClosing() || member_ == nullptr) return;
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
        if (!self->life_.isClosing()) self->end();  // else async_close ends it
        return;
      }
      if (self->life_.isClosing()) return;
      self->life_.frameCame();
      const auto data = self->buffer_.data();
      const std::string_view text(static_cast<const char*>(data.data()), data.size());
      const auto refused = self->socket_.got_text()
                               ? self->hall_.rooms.receive(self->member_, text, SocketLife::now_s())
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
  bool writing_ = false;
  std::uint64_t sent_bytes_ = 0, received_bytes_ = 0;
  SocketLife life_{socket_};
};

}  // namespace filiform::tools::internal
