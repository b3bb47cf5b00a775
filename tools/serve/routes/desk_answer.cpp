#include "tools/serve/routes/desk_answer.h"

#include "index/text.h"
#include "tools/serve/desk/desk_address.h"
#include "tools/serve/routes/service.h"

namespace filiform::tools {

std::optional<DeskRequest> deskRequest(const Request& request) {
  const std::vector<std::string>& parts = request.parts;
  const bool looks_on = parts.size() == 6 && parts[5] == "page";
  if (request.method != "GET" || (parts.size() != 5 && !looks_on)) return std::nullopt;
  if (parts[0] != "v1" || parts[1] != "sets" || parts[3] != "desks") return std::nullopt;
  return DeskRequest{looks_on ? DeskMember::Role::page : DeskMember::Role::desk,
                     {parts[2], parts[4], request.parameter("revision").value_or("")}};
}

std::optional<DeskRefusal> refuseRoom(const SetShelf& shelf, const DeskRoomName& room, const Person* who) {
  if (!isDeskName(room.desk))
    return DeskRefusal{DeskCode::policy, "the name of a desk is 1 to 32 letters, digits, '-', '_' or '.'"};
  const auto served = shelf.find(room.set, who);
  if (served == nullptr)
    return DeskRefusal{DeskCode::no_set, "this server has no set '" + escaped(room.set, 40) + "'; /v1/sets lists them"};
  const std::string& revision = served->set().revision();
  if (room.revision == revision) return std::nullopt;
  return DeskRefusal{DeskCode::other_revision, "the server has revision " + escaped(revision, 30) + ", not " +
                                                   escaped(room.revision, 30) + "; open the same set on both sides"};
}

// These two are for a request that is no WebSocket upgrade.
Answer deskAnswer(const Call&) {
  Answer answer =
      problem(426, "open a WebSocket here, with filiform view SET --follow, or with the page /travel/{set}");
  answer.headers.emplace_back("Upgrade", "websocket");
  return answer;
}

Answer sessionAnswer(const Call&) {
  Answer answer = problem(426, "open a WebSocket here; tools/serve/PROTOCOL.md describes filiform.v1");
  answer.headers.emplace_back("Upgrade", "websocket");
  return answer;
}

}  // namespace filiform::tools
