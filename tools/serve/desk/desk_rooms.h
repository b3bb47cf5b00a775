// DeskRooms: who shows a place, and who looks on. In a room, one desk sends its place, and pages get the newest one. A
// room is of one set in one revision. Without sockets. Thread rule: one owner.
#pragma once

#include "tools/serve/desk/desk_place.h"

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

namespace filiform::tools {

// Close codes of the WebSocket. Those from 4000 on are final: a client does not come back by itself.
enum class DeskCode : std::uint16_t {
  going_away = 1001,  // the server ends
  policy = 1008,      // a text that is no place, or too many of them
  full = 1013,        // too many rooms, or pages in the room
  replaced = 4000,    // another desk has taken the name
  no_set = 4004,
  other_revision = 4009,
};

struct DeskRefusal {
  DeskCode code;
  std::string reason;  // at most 123 bytes
};

// One connection. The owner of the connection sends what takeNews() returns.
class DeskMember {
 public:
  enum class Role : std::uint8_t { desk, page };
  // `has_news`: called when there is news to send; `ends`: when the room ends the connection. They may call leave()
  // only.
  DeskMember(Role role, std::function<void()> has_news, std::function<void(const DeskRefusal&)> ends)
      : role_(role), has_news_(std::move(has_news)), ends_(std::move(ends)) {}

  // The newest text for a page, once. Older ones are dropped.
  std::optional<std::string> takeNews() { return std::exchange(news_, std::nullopt); }

 private:
  friend class DeskRooms;
  const Role role_;
  const std::function<void()> has_news_;
  const std::function<void(const DeskRefusal&)> ends_;
  std::optional<std::string> news_;
  double allowed_ = 0, allowed_s_ = 0;  // of a desk: messages that may come now; as of this time
};

struct DeskRoomName {
  std::string set, desk, revision;
  auto operator<=>(const DeskRoomName&) const = default;
};

class DeskRooms {
 public:
  static constexpr std::size_t kRooms = 64, kPages = 32;          // at once; in a room
  static constexpr double kMostRate_Hz = 120, kMostAtOnce = 480;  // of messages of a desk
  static constexpr const char* kGone = R"({"desk":false})";       // a page gets it while no desk is there

  static constexpr const char* kWelcome = R"({"desk":true})";  // a desk gets it in its room

  // A page gets the newest place at once. A desk replaces the desk that is there. Returns why the member may not enter.
  std::optional<DeskRefusal> enter(const std::shared_ptr<DeskMember>& member, const DeskRoomName& name, double now_s);
  // A message of a member. Returns why its connection must end.
  std::optional<DeskRefusal> receive(const std::shared_ptr<DeskMember>& member, std::string_view text, double now_s);
  // Without effect for a member that is in no room.
  void leave(const std::shared_ptr<DeskMember>& member);

  std::size_t rooms() const { return rooms_.size(); }

 private:
  struct Room {
    std::shared_ptr<DeskMember> desk;
    std::set<std::shared_ptr<DeskMember>> pages;
    std::string newest = kGone;
  };
  static void tell(Room& room, std::string text);

  std::map<DeskRoomName, Room> rooms_;
  std::map<const DeskMember*, DeskRoomName> where_;
};

}  // namespace filiform::tools
