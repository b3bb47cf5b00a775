#include "index/geometry/internal/key_sort.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

TEST(KeySort, SortsWhateverBitsDiffer) {
  std::mt19937_64 random(17);
  for (const std::size_t n : {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{700}, std::size_t{5000}})
    for (const int bits : {0, 1, 9, 40, 64, 65, 100, 126}) {
      const MortonKey base = (MortonKey{random()} << 64 | random()) >> 2;
      const MortonKey mask = bits == 0 ? 0 : ~MortonKey{0} >> (128 - bits);
      std::vector<MortonKey> keys;
      for (std::size_t i = 0; i < n; ++i) {
        const MortonKey value = MortonKey{random()} << 64 | random();
        keys.push_back((base & ~mask) | (value & mask & (i % 3 == 0 ? mask >> (bits / 2) : mask)));
      }
      std::vector<MortonKey> expected = keys;
      std::sort(expected.begin(), expected.end());
      sortKeys(keys);
      ASSERT_TRUE(keys == expected) << n << " keys of " << bits << " bits";
    }
}

}  // namespace
}  // namespace filiform::internal
