#include "index/geometry/internal/key_sort.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <utility>

namespace filiform::internal {
namespace {

constexpr int kDigitBits = 11;
constexpr std::size_t kFewKeys = 512;  // up to this many keys are sorted by comparisons

// Sorts by digits from the lowest up; skips digits that all keys share.
void radixSort(std::vector<std::uint64_t>& keys, std::vector<std::uint64_t>& other, std::uint64_t differing) {
  constexpr std::size_t kBuckets = std::size_t{1} << kDigitBits;
  std::array<std::uint32_t, kBuckets> at;
  other.resize(keys.size());
  for (int shift = 0; shift < 64 && differing >> shift != 0; shift += kDigitBits) {
    if ((differing >> shift & (kBuckets - 1)) == 0) continue;
    at.fill(0);
    for (std::uint64_t key : keys) ++at[key >> shift & (kBuckets - 1)];
    std::uint32_t sum = 0;
    for (std::uint32_t& n : at) n = std::exchange(sum, sum + n);
    for (std::uint64_t key : keys) other[at[key >> shift & (kBuckets - 1)]++] = key;
    keys.swap(other);
  }
}

void sortRange(std::span<MortonKey> keys, std::vector<std::uint64_t>& low, std::vector<std::uint64_t>& other) {
  while (keys.size() > kFewKeys) {
    MortonKey differing = 0;
    for (const MortonKey key : keys) differing |= key ^ keys[0];
    if (differing == 0) return;
    const auto high = static_cast<std::uint64_t>(differing >> 64);
    if (high == 0 && keys.size() <= UINT32_MAX) {
      const MortonKey upper = keys[0] >> 64 << 64;
      low.assign(keys.begin(), keys.end());
      radixSort(low, other, static_cast<std::uint64_t>(differing));
      std::transform(low.begin(), low.end(), keys.begin(), [&](std::uint64_t key) { return upper | key; });
      return;
    }
    // The differing bits do not fit a word: split at the first differing bit. The depth is at most the length of a key.
    const int bit =
        high != 0 ? 127 - std::countl_zero(high) : 63 - std::countl_zero(static_cast<std::uint64_t>(differing));
    const auto middle = std::partition(keys.begin(), keys.end(), [&](MortonKey key) { return (key >> bit & 1) == 0; });
    const auto n = static_cast<std::size_t>(middle - keys.begin());
    sortRange(keys.first(n), low, other);
    keys = keys.subspan(n);
  }
  std::sort(keys.begin(), keys.end());
}

}  // namespace

void KeySorter::sort(std::vector<MortonKey>& keys) { sortRange(keys, low_, other_); }

}  // namespace filiform::internal
