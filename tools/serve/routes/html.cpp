#include "tools/serve/routes/html.h"

#include <cctype>

namespace filiform::tools {

std::string htmlText(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      case '\'':
        safe += "&#39;";
        break;
      default:
        safe += static_cast<unsigned char>(c) < 0x20 && c != '\n' ? ' ' : c;
    }
  }
  return safe;
}

std::string urlPart(const std::string& name) {
  static constexpr char kHex[] = "0123456789ABCDEF";
  std::string part;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte < 0x80 && std::isalnum(byte) != 0) || c == '-' || c == '_' || c == '.' || c == '~')
      part += c;
    else
      ((part += '%') += kHex[byte >> 4]) += kHex[byte & 15];
  }
  return part;
}

}  // namespace filiform::tools
