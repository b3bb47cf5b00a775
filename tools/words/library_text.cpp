#include "tools/words/library_text.h"

namespace filiform::tools {

std::string withPlainOptions(std::string message) {
  for (std::size_t at = 0; (at = message.find("--", at)) != std::string::npos; ++at)
    if ((at == 0 || message[at - 1] == ' ') && at + 2 < message.size() && message[at + 2] >= 'a' &&
        message[at + 2] <= 'z')
      message.erase(at, 2);
  return message;
}

}  // namespace filiform::tools
