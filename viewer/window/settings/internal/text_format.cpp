#include "viewer/window/settings/internal/text_format.h"

#include <array>
#include <cstdarg>
#include <cstdio>

namespace filiform::internal {

std::string format(const char* pattern, ...) {
  std::array<char, 256> text{};
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text.data(), text.size(), pattern, arguments);
  va_end(arguments);
  return text.data();
}

std::string unitText(std::string_view unit) {
  if (!unit.starts_with("um")) return std::string(unit);
  return std::string("\u00b5m") + (unit == "um2" ? "\u00b2" : unit == "um3" ? "\u00b3" : "");
}

}  // namespace filiform::internal
