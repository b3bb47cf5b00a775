#include "tools/serve/people/secret.h"

#include "index/errors.h"
#include "index/text.h"
#include "tools/words/token.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <unistd.h>

namespace filiform::tools {

std::string randomText() {
  std::array<unsigned char, 16> bytes{};
  if (::getentropy(bytes.data(), bytes.size()) != 0) throw IoError("the system's random numbers", "cannot read", errno);
  std::string text;
  for (const unsigned char byte : bytes) {
    static constexpr char kHex[] = "0123456789abcdef";
    (text += kHex[byte >> 4]) += kHex[byte & 15];
  }
  return text;
}

bool isSecret(std::string_view text, std::string_view secret) {
  if (secret.empty()) return false;
  unsigned difference = text.size() == secret.size() ? 0 : 1;
  for (std::size_t i = 0; i < text.size(); ++i)
    difference |= static_cast<unsigned char>(text[i]) ^ static_cast<unsigned char>(secret[i % secret.size()]);
  return difference == 0;
}

bool isFitToken(std::string_view text) {
  constexpr std::size_t kLeast = 16, kMost = 512;
  return text.size() >= kLeast && text.size() <= kMost && text.find_first_of(";,\"\\") == std::string_view::npos &&
         std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < '\x7f'; });
}

std::string readToken(const std::string& option, const std::string& path) {
  std::string token = readTokenFile(option, path);
  if (!isFitToken(token))
    throw UsageError(option + " " + inShort(path) +
                     ": its first line must be a token of 16 to 512 letters and "
                     "digits, such as 'openssl rand -hex 32' prints");
  return token;
}

}  // namespace filiform::tools
