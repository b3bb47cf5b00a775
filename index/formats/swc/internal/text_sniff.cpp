#include "index/formats/swc/internal/text_sniff.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>

namespace filiform::internal {

namespace {

// A tar archive begins with a block of 512 bytes. The eight bytes at 148 hold the block's sum in octal digits, computed
// with blanks in these eight. Old archives have no other mark.
bool isTar(std::string_view head) {
  constexpr std::size_t kTarBlock = 512, kSum = 148, kSumBytes = 8;
  if (head.size() < kTarBlock || head[0] == '\0') return false;
  std::uint32_t stated = 0, sum = 0;
  bool digits = false;
  for (const char c : head.substr(kSum, kSumBytes)) {
    if (c >= '0' && c <= '7') {
      stated = stated * 8 + static_cast<std::uint32_t>(c - '0');
      digits = true;
    } else if (c != ' ' && c != '\0') {
      return false;
    }
  }
  for (std::size_t i = 0; i < kTarBlock; ++i)
    sum += i >= kSum && i < kSum + kSumBytes ? std::uint32_t{' '} : static_cast<unsigned char>(head[i]);
  return digits && sum == stated;
}

// Pairs of bytes of which at least two in five have a NUL at `high` and a character of text beside it; the others are
// characters beyond Latin-1. No byte of a character below is NUL.
bool isUtf16(std::string_view head, std::size_t high) {
  std::size_t plain = 0, text = 0;
  const std::size_t pairs = head.size() / 2;
  for (std::size_t i = 0; i < pairs; ++i) {
    const auto low = static_cast<unsigned char>(head[2 * i + 1 - high]);
    if (low == 0) return false;
    if (head[2 * i + high] != '\0') continue;
    ++plain;
    text += low >= 0x20 || (low >= '\t' && low <= '\r');
  }
  return pairs >= 2 && plain * 5 >= pairs * 2 && text * 20 >= plain * 19;
}

}  // namespace

bool hasBinaryMagic(std::string_view head) {
  using namespace std::string_view_literals;
  static constexpr std::string_view kMagics[] = {"\x1F\x8B"sv,
                                                 "PK\x03\x04"sv,
                                                 "PK\x05\x06"sv,
                                                 "\x89HDF\r\n\x1A\n"sv,
                                                 "\x28\xB5\x2F\xFD"sv,
                                                 "\xFD"
                                                 "7zXZ\0"sv,
                                                 "7z\xBC\xAF\x27\x1C"sv,
                                                 "BZh"sv};
  return isTar(head) || std::any_of(std::begin(kMagics), std::end(kMagics),
                                    [&](std::string_view magic) { return head.starts_with(magic); });
}

bool isWideText(std::string_view head) {
  using namespace std::string_view_literals;
  if (head.starts_with("\xFF\xFE"sv) || head.starts_with("\xFE\xFF"sv) || head.starts_with("\0\0\xFE\xFF"sv))
    return true;
  if (isUtf16(head, 0) || isUtf16(head, 1)) return true;
  const std::size_t rounds = head.size() / 4;
  if (rounds < 2) return false;
  std::array<std::size_t, 4> nuls{};
  for (std::size_t i = 0; i < rounds * 4; ++i) nuls[i % 4] += head[i] == '\0';
  const auto mostly = [&](std::size_t residue) { return nuls[residue] * 10 >= rounds * 9; };
  const auto hardly = [&](std::size_t residue) { return nuls[residue] * 10 <= rounds; };
  const bool utf16 =
      (mostly(0) && mostly(2) && hardly(1) && hardly(3)) || (mostly(1) && mostly(3) && hardly(0) && hardly(2));
  const bool utf32 = mostly(1) && mostly(2) && ((mostly(0) && hardly(3)) || (mostly(3) && hardly(0)));
  return utf16 || utf32;
}

}  // namespace filiform::internal
