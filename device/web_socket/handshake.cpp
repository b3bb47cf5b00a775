#include "device/web_socket/handshake.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <system_error>

namespace filiform::internal {
namespace {

constexpr std::size_t kMostAnswer = 16 * 1024;                                  // bytes
constexpr std::string_view kConstant = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";  // RFC 6455, 1.3

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

std::string base64(std::string_view bytes) {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    std::uint32_t group = 0;
    for (std::size_t i = 0; i < 3; ++i)
      group = group << 8 | (at + i < bytes.size() ? static_cast<std::uint8_t>(bytes[at + i]) : 0u);
    for (std::size_t i = 0; i < 4; ++i) out += at + i <= bytes.size() ? kLetters[group >> (18 - 6 * i) & 63u] : '=';
  }
  return out;
}

std::optional<std::size_t> headerNumber(std::string_view digits) {
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  return number;
}

std::string sha1(std::string_view text) {
  std::string padded(text);
  padded += '\x80';
  while (padded.size() % 64 != 56) padded += '\0';
  for (int shift = 56; shift >= 0; shift -= 8)
    padded += static_cast<char>(static_cast<std::uint8_t>(std::uint64_t{text.size()} * 8 >> shift));
  std::array<std::uint32_t, 5> sum{0x67452301, 0xefcdab89, 0x98badcfe, 0x10325476, 0xc3d2e1f0};
  for (std::size_t block = 0; block < padded.size(); block += 64) {
    std::array<std::uint32_t, 80> word{};
    for (std::size_t i = 0; i < 64; ++i) word[i / 4] = word[i / 4] << 8 | static_cast<std::uint8_t>(padded[block + i]);
    for (std::size_t i = 16; i < 80; ++i)
      word[i] = std::rotl(word[i - 3] ^ word[i - 8] ^ word[i - 14] ^ word[i - 16], 1);
    auto [a, b, c, d, e] = sum;
    for (std::size_t i = 0; i < 80; ++i) {
      const std::uint32_t mixed = i < 20   ? ((b & c) | (~b & d)) + 0x5a827999
                                  : i < 40 ? (b ^ c ^ d) + 0x6ed9eba1
                                  : i < 60 ? ((b & c) | (b & d) | (c & d)) + 0x8f1bbcdc
                                           : (b ^ c ^ d) + 0xca62c1d6;
      const std::uint32_t first = std::rotl(a, 5) + mixed + e + word[i];
      e = d;
      d = c;
      c = std::rotl(b, 30);
      b = a;
      a = first;
    }
    const std::array<std::uint32_t, 5> added{a, b, c, d, e};
    for (std::size_t i = 0; i < 5; ++i) sum[i] += added[i];
  }
  std::string out;
  for (const std::uint32_t part : sum)
    for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(static_cast<std::uint8_t>(part >> shift));
  return out;
}

}  // namespace

std::string webSocketKey() {
  std::random_device random;
  std::string bytes;
  for (int i = 0; i < 16; ++i) bytes += static_cast<char>(static_cast<std::uint8_t>(random()));
  return base64(bytes);
}

std::string acceptOf(std::string_view key) { return base64(sha1(std::string(key) + std::string(kConstant))); }

std::string_view headerField(std::string_view head, std::string_view name) {
  while (!head.empty()) {
    const std::size_t end = std::min(head.find("\r\n"), head.size());
    const std::string_view line = head.substr(0, end);
    head.remove_prefix(std::min(head.size(), end + 2));
    if (line.size() <= name.size() || line[name.size()] != ':') continue;
    if (!std::equal(name.begin(), name.end(), line.begin(), [](char a, char b) { return a == lower(b); })) continue;
    std::string_view value = line.substr(name.size() + 1);
    while (!value.empty() && (value.front() == ' ' || value.front() == '\t')) value.remove_prefix(1);
    while (!value.empty() && (value.back() == ' ' || value.back() == '\t')) value.remove_suffix(1);
    return value;
  }
  return {};
}

HttpAnswer askHttp(ByteStream& stream, const std::string& request, double until_s) {
  const auto left_s = [&] { return std::max(0.0, until_s - stream.time_s()); };
  HttpAnswer answer;
  answer.trouble = "it ends the connection";
  if (!stream.write(request, left_s())) return answer;
  std::array<char, kHttpBlock> block{};
  std::string text;
  std::size_t head = std::string::npos, whole = kMostAnswer;  // lengths
  while (text.size() < whole) {
    const long got = stream.read(block, left_s());
    if (got == 0) answer.trouble = "it does not answer";
    if (got <= 0) break;
    text.append(block.data(), static_cast<std::size_t>(got));
    if (head != std::string::npos || (head = text.find("\r\n\r\n")) == std::string::npos) continue;
    head += 4;
    answer.head = text.substr(0, head);
    answer.status = text.starts_with("HTTP/1.1 ") ? headerNumber(text.substr(9, 3)).value_or(0) : 0;
    whole =
        answer.status <= 101 ? head : head + headerNumber(headerField(answer.head, "content-length")).value_or(whole);
    whole = std::min(whole, kMostAnswer);
  }
  if (head == std::string::npos ? text.size() >= whole : answer.status == 0) answer.trouble = "it does not speak HTTP";
  if (head != std::string::npos)
    answer.rest = text.substr(head, answer.status > 101 ? whole - head : std::string::npos);
  return answer;
}

}  // namespace filiform::internal
