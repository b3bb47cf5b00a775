#include "tools/words/token.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <fstream>

namespace filiform::tools {

namespace {

constexpr std::size_t kMostTokenBytes = 4096;

}  // namespace

std::string tokenIn(std::string_view text, const std::string& named) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  text = text.substr(0, text.find('\n'));
  if (text.size() > kMostTokenBytes) throw UsageError(named + ": its first line has more than 4 KiB");
  const std::size_t begin = std::min(text.find_first_not_of(" \t\r"), text.size());
  const std::string token(text.substr(begin, text.find_last_not_of(" \t\r") + 1 - begin));
  if (token.empty()) throw UsageError(named + ": its first line is empty; write the token there");
  if (!std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c < '\x7f'; }))
    throw UsageError(named +
                     ": its first line has a blank or a character that is not ASCII; write the token alone there");
  return token;
}

std::string readTokenFile(const std::string& option, const std::string& path) {
  const std::string named = option + " " + escaped(path, 200);
  std::ifstream in(path, std::ios::binary);
  if (!in) throw IoError(named, "cannot open the file that holds the token", errno);
  std::string text(kMostTokenBytes + 8, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad()) throw IoError(named, "cannot read the file that holds the token", errno);
  text.resize(static_cast<std::size_t>(in.gcount()));
  return tokenIn(text, named);
}

}  // namespace filiform::tools
