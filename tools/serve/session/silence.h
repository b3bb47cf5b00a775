// Silence: what is due when a session's client says nothing. The caller passes the time, so tests need not wait.
// Thread rule: one owner.
#pragma once

#include "tools/serve/session/session_client.h"

namespace filiform::tools {

class Silence {
 public:
  enum class Due {
    nothing,
    ping,   // the caller sends one, and calls pingSent()
    close,  // the client sent no frame for kIdle_s; it still answers pings, so the caller tells it the reason
    end     // the client answered no ping for twice kPing_s; the caller drops the connection
  };

  explicit Silence(double now_s) : heard_s_(now_s), answered_s_(now_s), pinged_s_(now_s) {}

  void frameCame(double now_s) { heard_s_ = now_s; }
  void pongCame(double now_s) { answered_s_ = now_s; }
  void pingSent(double now_s) { pinged_s_ = now_s; }

  Due at(double now_s) const {
    if (now_s - answered_s_ > 2 * session_limits::kPing_s) return Due::end;
    if (now_s - heard_s_ > session_limits::kIdle_s) return Due::close;
    return now_s - pinged_s_ > session_limits::kPing_s ? Due::ping : Due::nothing;
  }

 private:
  double heard_s_, answered_s_, pinged_s_;
};

}  // namespace filiform::tools
