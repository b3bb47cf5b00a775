#include "tools/words/library_text.h"

#include "index/text.h"

namespace filiform::tools {

std::string withPlainOptions(std::string message) {
  for (std::size_t at = 0; (at = message.find("--", at)) != std::string::npos; ++at)
    if ((at == 0 || message[at - 1] == ' ') && at + 2 < message.size() && message[at + 2] >= 'a' &&
        message[at + 2] <= 'z')
      message.erase(at, 2);
  return message;
}

std::string inLibraryWords(std::string message,
                           std::span<const std::pair<std::string_view, std::string_view>> phrases) {
  for (const auto& [program, library] : phrases)
    if (const std::size_t at = message.find(program); at != std::string::npos)
      message.replace(at, program.size(), library);
  return withPlainOptions(withShortWords(message));
}

}  // namespace filiform::tools
