// SessionClient: the protocol filiform.v1 for one client, without a socket. tools/serve/PROTOCOL.md describes it.
//
//   SessionClient client(house, version);
//   send(client.answer(text));                          // for each text frame, one at a time
//   if (const auto refused = client.receive(bytes))     // for each binary frame
//     close(refused->code, refused->reason);
//   client.takeFrames(send);                            // after each round of the ticker
//
// Thread rule: receive() and takeFrames() belong to the thread of the connection; answer() may run beside them on
// another thread, one call at a time, and may wait for the disk. close(): once, when neither runs.
#pragma once

#include "tools/serve/session/json_rpc.h"
#include "tools/serve/session/outbox.h"
#include "tools/serve/session/session_house.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

namespace session_limits {

inline constexpr std::size_t kFrameBytes = 64 << 10;  // of a frame from the client
inline constexpr std::size_t kErrors = 100;           // wrong requests and frames in a row, then the connection ends
inline constexpr double kPing_s = 10, kIdle_s = 60;   // without a frame from the client

}  // namespace session_limits

// Close codes of RFC 6455 that the server sends.
enum class CloseCode : std::uint16_t {
  normal = 1000,
  going_away = 1001,   // the server ends
  unsupported = 1003,  // a binary frame that is no HAND
  policy = 1008,       // too many errors, or no frame for 60 s
  too_big = 1009,      // a frame longer than 64 KiB
  internal = 1011,
};

struct SessionRefusal {
  CloseCode code;
  std::string reason;  // at most 123 bytes
};

class SessionClient {
 public:
  // The house must outlive this object. `version`: of the server. `who`: whose sets the client may know of; nullptr:
  // all sets.
  SessionClient(SessionHouse& house, std::string version, PersonPointer who = nullptr);
  ~SessionClient();

  // The answer to a text frame; empty: none.
  std::string answer(std::string_view text);
  // After answer(): why the connection must end.
  std::optional<SessionRefusal> refusal() const;
  // Takes a binary frame. A HAND before `open` is ignored, and one with wrong values changes nothing and is counted.
  std::optional<SessionRefusal> receive(std::span<const unsigned char> bytes);
  // Calls `send` for each binary frame that the client may get now: at most one PROXY and one LOCAL MODEL. True if one
  // was sent.
  bool takeFrames(const std::function<void(std::span<const unsigned char>)>& send);
  // Notifications for the client.
  std::vector<std::string> takeNotes();

  void close();

 private:
  using Json = nlohmann::ordered_json;
  using Params = nlohmann::json;

  Json call(const std::string& method, const Params& params);
  Json hello(const Params& params);
  Json open(const Params& params);
  Json jump(const Params& params);
  Json mode(const Params& params);
  Json parameters(const Params& params);
  Json workspace(const Params& params);
  Json follow(const Params& params);
  Json subscribe(const Params& params);

  std::shared_ptr<RemoteSession> session() const;
  RemoteSession& opened() const;
  Json placeJson(const RemoteSession& session, const ProxyPlace& place) const;
  ProxyPlace placeOf(const RemoteSession& session, const Params& params) const;
  void count(std::size_t errors, std::size_t calls);

  SessionHouse& house_;
  const std::string version_;
  const PersonPointer who_;
  bool greeted_ = false;  // answer()'s
  mutable std::mutex mutex_;
  std::shared_ptr<RemoteSession> session_;
  std::size_t errors_ = 0;  // in a row
  // The connection's.
  std::shared_ptr<RemoteSession> shown_;
  Outbox outbox_;
  ModelMaker::Frame model_;
  bool model_waits_ = false;
};

}  // namespace filiform::tools
