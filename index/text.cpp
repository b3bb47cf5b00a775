#include "index/text.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>

namespace filiform {
namespace {

constexpr std::string_view kBase64Digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

bool isHarmless(char32_t c) {
  if (c < 0x20 || (c >= 0x7F && c < 0xA0)) return false;
  const bool bidirectional =
      (c >= 0x202A && c <= 0x202E) || (c >= 0x2066 && c <= 0x2069) || c == 0x200E || c == 0x200F || c == 0x061C;
  const bool line_end = c == 0x2028 || c == 0x2029;
  return !bidirectional && !line_end;
}

void appendFormatted(std::string& out, const char* format, unsigned value) {
  char buffer[16];
  std::snprintf(buffer, sizeof buffer, format, value);
  out += buffer;
}

}  // namespace

Utf8Character decodeUtf8(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return {1, first};
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return {};
  char32_t code_point = first & (0xFFu >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return {};
    code_point = code_point << 6 | (byte(i) & 0x3F);
  }
  static constexpr char32_t kLowest[] = {0, 0, 0x80, 0x800, 0x10000};
  if (code_point < kLowest[length] || code_point > 0x10FFFF || (code_point >= 0xD800 && code_point <= 0xDFFF))
    return {};
  return {length, code_point};
}

std::string escaped(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const Utf8Character decoded = decodeUtf8(text);
    const std::size_t length = decoded.length == 0 ? 1 : decoded.length;
    if (decoded.length == 0) {
      appendFormatted(out, "\\x%02x", static_cast<unsigned char>(text[0]));
    } else if (isHarmless(decoded.code_point)) {
      out += text.substr(0, length);
    } else if (decoded.code_point == '\t') {
      out += "\\t";
    } else if (decoded.code_point == '\n') {
      out += "\\n";
    } else if (decoded.code_point == '\r') {
      out += "\\r";
    } else {
      appendFormatted(out, length == 1 ? "\\x%02x" : "\\u%04x", decoded.code_point);
    }
    text.remove_prefix(length);
  }
  return out;
}

std::string escaped(std::string_view text, std::size_t limit) {
  if (text.size() <= limit) return escaped(text);
  std::size_t end = limit;
  // Step back if the limit would cut a character. Stray continuation bytes are not a character.
  for (std::size_t back = 0; back < 3 && end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80; ++back)
    --end;
  return escaped(text.substr(0, end)) + "...";
}

std::string inShort(std::string_view text) {
  static constexpr std::size_t kMost = 200, kEnd = 60;
  if (text.size() <= kMost) return escaped(text);
  std::size_t end = text.size() - kEnd;
  while (end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) ++end;
  return escaped(text, kMost - kEnd - 3) + escaped(text.substr(end));
}

std::string withShortWords(std::string_view message) {
  std::string out;
  while (!message.empty()) {
    const std::string_view word = message.substr(0, message.find(' '));
    out += inShort(word);
    message.remove_prefix(word.size());
    const std::size_t blanks = std::min(message.find_first_not_of(' '), message.size());
    out += message.substr(0, blanks);
    message.remove_prefix(blanks);
  }
  return out;
}

bool isUtf8(std::string_view text) {
  while (!text.empty()) {
    const Utf8Character decoded = decodeUtf8(text);
    if (decoded.length == 0) return false;
    text.remove_prefix(decoded.length);
  }
  return true;
}

std::string lowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

bool endsWithNoCase(std::string_view name, std::string_view suffix) {
  return name.size() >= suffix.size() && lowerCase(name.substr(name.size() - suffix.size())) == suffix;
}

std::string toBase64(std::string_view bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - at);
    std::uint32_t group = 0;
    for (std::size_t i = 0; i < 3; ++i) group = group << 8 | (i < n ? static_cast<std::uint8_t>(bytes[at + i]) : 0u);
    for (std::size_t i = 0; i < 4; ++i) text += i <= n ? kBase64Digits[group >> (18 - 6 * i) & 63] : '=';
  }
  return text;
}

std::optional<std::string> fromBase64(std::string_view text) {
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3);
  std::uint32_t group = 0;
  int bits = 0;
  for (const char c : text.substr(0, text.find('='))) {
    const std::size_t digit = kBase64Digits.find(c);
    if (digit == std::string_view::npos) return std::nullopt;
    group = (group << 6 | static_cast<std::uint32_t>(digit)) & 0xFFFFFF;
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(group >> bits);
  }
  if (toBase64(bytes) != text) return std::nullopt;
  return bytes;
}

}  // namespace filiform
