// The routes /v1/sets/{set}/desks/{desk}: WebSockets of desks, which show their place, and of pages, which look on
// (tools/serve/desk/desk_rooms.h). Functions without state.
#pragma once

#include "tools/serve/desk/desk_rooms.h"
#include "tools/serve/routes/request.h"

#include <optional>

namespace filiform::tools {

struct DeskRequest {
  DeskMember::Role role = DeskMember::Role::page;
  DeskRoomName room;
};
// What a request for such a route asks for; nullopt: it is another request. The server then upgrades the connection, if
// the client asks for that.
std::optional<DeskRequest> deskRequest(const Request& request);

class SetShelf;

// Why the room cannot be: no such set, another revision, or a wrong name. nullopt: it can.
std::optional<DeskRefusal> refuseRoom(const SetShelf& shelf, const DeskRoomName& room, const Person* who);

}  // namespace filiform::tools
