// The address at which a desk shows itself: ws://HOST[:PORT]/v1/sets/SET/desks/NAME. Thread rule: a value.
#pragma once

#include <string>
#include <string_view>

namespace filiform::tools {

struct DeskAddress {
  std::string host;  // without the brackets of IPv6
  std::string port = "80";
  std::string path;  // as given, from its first slash
  std::string text;  // the whole address

  // Throws UsageError, whose line says what an address looks like.
  static DeskAddress parse(const std::string& text);
  // HOST or HOST:PORT, as the header Host has it.
  std::string authority() const;
};

// 1 to 32 letters, digits, '-', '_' or '.'.
bool isDeskName(std::string_view name);

}  // namespace filiform::tools
