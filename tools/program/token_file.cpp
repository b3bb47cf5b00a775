#include "tools/program/token_file.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <fstream>

namespace filiform::tools {

std::string readTokenFile(const std::string& path) {
  constexpr std::size_t kMostTokenBytes = 4096;
  const std::string named = "--token-file " + inShort(path);
  std::ifstream in(path, std::ios::binary);
  if (!in) throw IoError(named, "cannot open", errno);
  std::string token(kMostTokenBytes + 1, '\0');
  in.read(token.data(), static_cast<std::streamsize>(token.size()));
  token.resize(static_cast<std::size_t>(in.gcount()));
  token.resize(std::min(token.find('\n'), token.size()));
  if (token.size() > kMostTokenBytes) throw UsageError(named + ": its first line has more than 4 KiB");
  if (token.starts_with("\xEF\xBB\xBF")) token.erase(0, 3);
  token.resize(token.find_last_not_of(" \t\r") + 1);
  if (token.empty()) throw UsageError(named + ": its first line is empty; write the token there");
  if (std::any_of(token.begin(), token.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }))
    throw UsageError(named + ": its first line has a control character; write the token alone there");
  return token;
}

}  // namespace filiform::tools
