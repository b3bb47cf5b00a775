#include "tools/serve/desk/desk_rooms.h"

#include <algorithm>

namespace filiform::tools {

void DeskRooms::tell(Room& room, std::string text) {
  room.newest = std::move(text);
  for (const auto& page : room.pages) {
    page->news_ = room.newest;
    page->has_news_();
  }
}

std::optional<DeskRefusal> DeskRooms::enter(const std::shared_ptr<DeskMember>& member, const DeskRoomName& name,
                                            double now_s) {
  if (!rooms_.contains(name) && rooms_.size() >= kRooms)
    return DeskRefusal{DeskCode::full, "this server has 64 desks already; come back later"};
  Room& room = rooms_[name];
  if (member->role_ == DeskMember::Role::page) {
    if (room.pages.size() >= kPages) return DeskRefusal{DeskCode::full, "32 pages look on already; come back later"};
    room.pages.insert(member);
    member->news_ = room.newest;
    where_[member.get()] = name;
    member->has_news_();
    return std::nullopt;
  }
  const std::shared_ptr<DeskMember> before = std::exchange(room.desk, member);
  where_[member.get()] = name;
  member->allowed_ = kMostAtOnce;
  member->allowed_s_ = now_s;
  if (before != nullptr) {
    where_.erase(before.get());
    before->ends_({DeskCode::replaced, "another desk with this name has come; choose another name"});
  }
  member->news_ = kWelcome;
  member->has_news_();
  return std::nullopt;
}

std::optional<DeskRefusal> DeskRooms::receive(const std::shared_ptr<DeskMember>& member, std::string_view text,
                                              double now_s) {
  const auto where = where_.find(member.get());
  if (where == where_.end()) return std::nullopt;  // replaced
  if (member->role_ == DeskMember::Role::page) return DeskRefusal{DeskCode::policy, "a page sends nothing"};
  const double passed_s = std::max(0.0, now_s - std::exchange(member->allowed_s_, now_s));
  member->allowed_ = std::min(kMostAtOnce, member->allowed_ + kMostRate_Hz * passed_s) - 1;
  if (member->allowed_ < 0) return DeskRefusal{DeskCode::policy, "more than 120 messages a second"};
  const std::optional<DeskPlace> place = parseDeskPlace(text);
  if (!place) return DeskRefusal{DeskCode::policy, "this is no place of a desk; tools/serve/README.md shows one"};
  tell(rooms_.at(where->second), toJson(*place));
  return std::nullopt;
}

void DeskRooms::leave(const std::shared_ptr<DeskMember>& member) {
  const auto where = where_.find(member.get());
  if (where == where_.end()) return;
  const auto found = rooms_.find(where->second);
  where_.erase(where);
  Room& room = found->second;
  room.pages.erase(member);
  if (room.desk == member) {
    room.desk.reset();
    tell(room, kGone);
  }
  if (room.desk == nullptr && room.pages.empty()) rooms_.erase(found);
}

}  // namespace filiform::tools
