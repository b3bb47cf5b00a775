// The redirect that keeps a token in a cookie and out of the address.
#include "tools/serve/routes/service.h"

namespace filiform::tools {

Answer tokenAnswer(const Call& call, const std::string& token, const std::string& page) {
  if (!call.service.access.isToken(token)) return call.service.access.wrongToken(call.request);
  Answer answer{.status = 303};
  answer.headers = {{"Location", page}, {"Set-Cookie", call.service.access.cookie(call.request)}};
  return answer;
}

}  // namespace filiform::tools
