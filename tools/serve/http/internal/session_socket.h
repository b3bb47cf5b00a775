// SessionSocket: one WebSocket, which speaks filiform.v1 through a SessionClient. Included by server.cpp alone, because
// it needs Boost.Beast. Thread rule: the thread of the server's io_context; answers are made on its workers.
#pragma once

#include "tools/serve/http/internal/socket_life.h"
#include "tools/serve/session/session_client.h"

#include <array>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

namespace filiform::tools::internal {

class SessionSocket;

// What the sockets share.
struct SocketHall {
  boost::asio::io_context& io;
  boost::asio::thread_pool& workers;
  SessionHouse* house = nullptr;  // nullptr: there are no sessions
  std::string version = {};
  std::function<void(const SessionSocket& socket)> log = {};  // at the end of a socket
  std::set<std::shared_ptr<SessionSocket>> sockets = {};
  std::atomic<bool> woken{false};  // a call of pumpAll() waits
};

class SessionSocket : public std::enable_shared_from_this<SessionSocket> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;
  using ErrorCode = boost::system::error_code;

  SessionSocket(boost::beast::tcp_stream stream, SocketHall& hall, std::string client_address, std::string target)
      : client_address_(std::move(client_address)),
        target_(std::move(target)),
        hall_(hall),
        socket_(std::move(stream)),
        client_(std::make_shared<SessionClient>(*hall.house, hall.version)) {}

  // Answers the upgrade. Of the subprotocols, only filiform.v1 is repeated: another may be a token.
  void begin(const Request& request) {
    namespace websocket = boost::beast::websocket;
    boost::beast::get_lowest_layer(socket_).expires_never();
    // watch() pings and keeps the limits of time: where a limit of the library passes while the socket closes, an
    // assertion of Boost 1.74 fails.
    socket_.set_option(
        websocket::stream_base::timeout{websocket::stream_base::none(), websocket::stream_base::none(), false});
    socket_.control_callback([this](websocket::frame_type kind, boost::beast::string_view) {
      if (kind == websocket::frame_type::pong) life_.pongCame();
    });
    socket_.read_message_max(session_limits::kFrameBytes);
    const bool named = offersProtocol(request);
    socket_.set_option(websocket::stream_base::decorator([named](websocket::response_type& response) {
      response.set(boost::beast::http::field::server, "filiform");
      if (named) response.set(boost::beast::http::field::sec_websocket_protocol, "filiform.v1");
    }));
    request_ = request;
    socket_.async_accept(request_, [self = shared_from_this()](ErrorCode error) {
      if (error) return self->end();
      self->life_.accepted();
      self->read();
    });
  }

  // Sends what may be sent now.
  void pump() {
    if (writing_ || life_.isClosing()) return;
    if (texts_.empty() && frames_.empty())
      client_->takeFrames([this](std::span<const unsigned char> bytes) {
        frames_.emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      });
    std::deque<std::string>& queue = texts_.empty() ? frames_ : texts_;
    if (queue.empty()) return;
    writing_ = true;
    socket_.text(&queue == &texts_);
    out_ = std::move(queue.front());
    queue.pop_front();
    socket_.async_write(boost::asio::buffer(out_), [self = shared_from_this()](ErrorCode error, std::size_t bytes) {
      self->writing_ = false;
      self->sent_bytes_ += bytes;
      if (error) return self->end();
      self->ask();
      self->pump();
    });
  }

  // Every 50 ms or so: notes for the client, and its silence.
  void watch() {
    const Silence::Due due = life_.watch(shared_from_this());
    if (due == Silence::Due::end) return end();
    if (due == Silence::Due::close) return close({CloseCode::policy, "no frame for 60 s"});
    if (life_.isClosing()) return;
    for (std::string& note : client_->takeNotes())
      if (texts_.size() < kMostTexts) texts_.push_back(std::move(note));
    pump();
  }

  // Closes the WebSocket with a code; the client may answer for kClosing.
  void close(const SessionRefusal& why) {
    if (!life_.beginClosing()) return;
    code_ = static_cast<unsigned>(why.code);
    life_.sendClose(static_cast<unsigned>(why.code), why.reason, [self = shared_from_this()] { self->end(); });
  }

  // Ends at once.
  void end() {
    if (!life_.end()) return;
    boost::beast::get_lowest_layer(socket_).close();
    if (hall_.log) hall_.log(*this);
    // The end of a recording may wait for the disk. No answer is made any more, because one worker makes the answers of
    // a socket at a time.
    if (!answering_) closeClient();
    hall_.sockets.erase(shared_from_this());
  }

  const std::string& clientAddress() const { return client_address_; }
  const std::string& target() const { return target_; }
  std::uint64_t sentBytes() const { return sent_bytes_; }
  std::uint64_t receivedBytes() const { return received_bytes_; }
  unsigned code() const { return code_; }  // of the close frame; 0: the connection ended without one
  double seconds() const { return life_.seconds(); }

  static bool offersProtocol(const Request& request) {
    const boost::beast::string_view offered = request[boost::beast::http::field::sec_websocket_protocol];
    for (const auto& name : boost::beast::http::token_list(offered))
      if (name == "filiform.v1") return true;
    return false;
  }

 private:
  static constexpr std::size_t kMostAsked = 16, kMostTexts = 8;  // of requests, of answers that wait

  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](ErrorCode error, std::size_t bytes) {
      self->received_bytes_ += bytes;
      if (error) return self->readFailed(error);
      self->life_.frameCame();
      self->take();
      if (!self->life_.isClosing()) self->read();
    });
  }

  void readFailed(const ErrorCode& error) {
    if (error == boost::beast::websocket::error::closed) code_ = socket_.reason().code;
    if (error == boost::beast::websocket::error::message_too_big) code_ = static_cast<unsigned>(CloseCode::too_big);
    if (life_.isClosing() && !life_.hasEnded()) return;  // async_close ends it
    end();
  }

  void take() {
    const auto data = buffer_.data();
    const auto* const bytes = static_cast<const unsigned char*>(data.data());
    if (socket_.got_text()) {
      if (asked_.size() >= kMostAsked) return close({CloseCode::policy, "more than 16 requests wait"});
      asked_.emplace_back(reinterpret_cast<const char*>(bytes), data.size());
      ask();
    } else if (const auto refused = client_->receive({bytes, data.size()})) {
      return close(*refused);
    } else {
      pump();  // an acknowledgement may let a frame go
    }
    buffer_.consume(buffer_.size());
  }

  // Has the next request answered, unless answers wait to be sent.
  void ask() {
    if (answering_ || life_.isClosing() || asked_.empty() || texts_.size() >= kMostTexts) return;
    answering_ = true;
    std::string text = std::move(asked_.front());
    asked_.pop_front();
    boost::asio::post(hall_.workers, [self = shared_from_this(), text = std::move(text)] {
      std::string answer = self->client_->answer(text);
      boost::asio::post(self->hall_.io, [self, answer = std::move(answer)]() mutable {
        self->answering_ = false;
        if (self->life_.hasEnded()) return self->closeClient();
        if (!answer.empty()) self->texts_.push_back(std::move(answer));
        if (const auto refused = self->client_->refusal()) return self->close(*refused);
        self->ask();
        self->pump();
      });
    });
  }

  void closeClient() {
    boost::asio::post(hall_.workers, [client = client_] { client->close(); });
  }

  const std::string client_address_, target_;
  SocketHall& hall_;
  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  const std::shared_ptr<SessionClient> client_;
  Request request_;
  boost::beast::flat_buffer buffer_;
  std::deque<std::string> asked_, texts_, frames_;
  std::string out_;
  bool writing_ = false, answering_ = false;
  unsigned code_ = 0;
  std::uint64_t sent_bytes_ = 0, received_bytes_ = 0;
  SocketLife life_{socket_};
};

// Called by the ticking thread: the sockets send what they have. Posts at most one call at a time.
inline void wake(SocketHall& hall) {
  if (hall.woken.exchange(true)) return;
  boost::asio::post(hall.io, [&hall] {
    hall.woken = false;
    for (const auto& socket : std::set(hall.sockets)) socket->pump();
  });
}

}  // namespace filiform::tools::internal
