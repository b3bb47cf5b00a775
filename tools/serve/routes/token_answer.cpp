// The redirect that keeps a token in a cookie and out of the address.
#include "tools/serve/routes/service.h"

namespace filiform::tools {

Answer tokenAnswer(const Call& call, const std::string& token, const std::string& page) {
  if (!call.service.access.isToken(token)) {
    Answer answer = problem(401, "this is not the server's token");
    answer.headers.emplace_back("WWW-Authenticate", "Bearer");
    return answer;
  }
  Answer answer{.status = 303};
  answer.headers = {{"Location", page},
                    {"Set-Cookie", std::string(kTokenCookie) + "=" + token + "; HttpOnly; SameSite=Strict; Path=/"}};
  return answer;
}

}  // namespace filiform::tools
