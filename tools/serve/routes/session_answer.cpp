#include "tools/serve/routes/service.h"

namespace filiform::tools {

// For a request that is no WebSocket upgrade.
Answer sessionAnswer(const Call&) {
  Answer answer = problem(426, "open a WebSocket here; tools/serve/PROTOCOL.md describes filiform.v1");
  answer.headers.emplace_back("Upgrade", "websocket");
  return answer;
}

}  // namespace filiform::tools
