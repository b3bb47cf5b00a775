// The pairs of two cells as bytes, about half as many as in memory. Thread rule: pure functions.
#pragma once

#include "index/contacts/internal/contact_pair.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace filiform::internal {

// Of a block of pairs of the same two cells. Bytes follow.
struct PairBlock {
  std::array<std::uint32_t, 2> cells;
  std::uint16_t pairs, bytes;
};
constexpr std::size_t kMostPairBytes = 80;  // of one

// Writes the pairs, which have the same two cells, to `to`, and returns the end. `are_counted`: only what tells which
// pairs are one site; all else is 0 afterwards. O(pairs).
std::uint8_t* encodePairs(std::span<const ContactPair> pairs, bool are_counted, std::uint8_t* to);
// Appends the pairs of a block. O(pairs).
void decodePairs(const PairBlock& block, const std::uint8_t* from, bool are_counted, std::vector<ContactPair>& pairs);

}  // namespace filiform::internal
