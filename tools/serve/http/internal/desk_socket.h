// DeskSocket: the WebSocket of a desk or of a page that looks on. Included by server.cpp alone, because it needs
// Boost.Asio. Thread rule: the thread of the server's io_context.
#pragma once

#include "tools/serve/desk/desk_rooms.h"
#include "tools/serve/http/internal/server_socket.h"

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <boost/asio/socket_base.hpp>

namespace filiform::tools::internal {

// What the sockets share.
struct DeskHall : SocketSet {
  using SocketSet::SocketSet;
  DeskRooms rooms = {};
};

class DeskSocket : public ServerSocket {
 public:
  // `refused`: why this client is not let in; it is told after the upgrade.
  DeskSocket(SocketOrigin origin, DeskHall& hall, DeskRoomName room, DeskMember::Role role,
             std::optional<DeskRefusal> refused)
      : ServerSocket(std::move(origin), hall, DeskPlace::kMostBytes),
        hall_(hall),
        room_(std::move(room)),
        role_(role),
        refused_(std::move(refused)) {
    ErrorCode ignored;  // without it, a client that reads slowly would get places that are minutes old
    wire().socket().set_option(boost::asio::socket_base::send_buffer_size(kUnread), ignored);
  }

  // Sends the newest news. One message at a time: a client that reads slowly misses the older ones.
  void pump() override {
    if (isSending() || isClosing() || member_ == nullptr) return;
    if (std::optional<std::string> news = member_->takeNews()) send(*news, true);
  }

 private:
  static constexpr int kUnread = 4096;  // bytes that the system keeps for a client that does not read

  void refuse(const DeskRefusal& why) { close(static_cast<unsigned>(why.code), why.reason); }

  void accepted() override {
    if (refused_) return refuse(*refused_);
    if (hasEnded()) return;
    member_ = std::make_shared<DeskMember>(
        role_, [this] { pump(); }, [this](const DeskRefusal& why) { refuse(why); });
    if (const auto full = hall_.rooms.enter(member_, room_, now_s())) return refuse(*full);
  }

  void take(std::string_view message, bool is_text) override {
    const auto refused = is_text ? hall_.rooms.receive(member_, message, now_s())
                                 : DeskRefusal{DeskCode::policy, "a place is a text, not binary"};
    if (refused) refuse(*refused);
  }

  void silent() override { forgetSilence(); }  // only pages may say nothing

  // The member may still have callbacks to this object.
  void leave() override {
    if (const auto member = std::exchange(member_, nullptr)) hall_.rooms.leave(member);
  }

  DeskHall& hall_;
  const DeskRoomName room_;
  const DeskMember::Role role_;
  const std::optional<DeskRefusal> refused_;
  std::shared_ptr<DeskMember> member_;  // while it is in the room
};

}  // namespace filiform::tools::internal
