#include "index/file/signature.h"

#include "index/file/internal/sha256.h"

#include <charconv>
#include <cstdint>

namespace filiform {

namespace {

std::string sha256Of(std::string_view first, std::string_view second) {
  internal::Sha256 digest;
  for (const std::string_view part : {first, second})
    digest.add({reinterpret_cast<const std::uint8_t*>(part.data()), part.size()});
  const std::string digits = digest.value();
  std::string bytes(digits.size() / 2, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    unsigned byte = 0;
    std::from_chars(digits.data() + 2 * i, digits.data() + 2 * i + 2, byte, 16);
    bytes[i] = static_cast<char>(byte);
  }
  return bytes;
}

}  // namespace

std::string sha256Digits(std::string_view text) {
  internal::Sha256 digest;
  digest.add({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  return digest.value();
}

// RFC 2104.
std::string signatureOf(std::string_view text, std::string_view key) {
  constexpr std::size_t kBlock = 64;
  std::string inner = key.size() > kBlock ? sha256Of(key, {}) : std::string(key);
  inner.resize(kBlock, '\0');
  std::string outer = inner;
  for (char& c : inner) c = static_cast<char>(c ^ 0x36);
  for (char& c : outer) c = static_cast<char>(c ^ 0x5c);
  std::string digits;
  for (const char c : sha256Of(outer, sha256Of(inner, text))) {
    static constexpr char kHex[] = "0123456789abcdef";
    const auto byte = static_cast<unsigned char>(c);
    (digits += kHex[byte >> 4]) += kHex[byte & 15];
  }
  return digits;
}

}  // namespace filiform
