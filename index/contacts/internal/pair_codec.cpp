#include "index/contacts/internal/pair_codec.h"

#include <cstring>
#include <type_traits>

namespace filiform::internal {
namespace {

// Visits what is stored of a pair: store(value, expected) for what is left out if it is as expected. Most segments
// have the rank of their child, and the sample before as the parent; the next pair often has the same segment.
template <class Pair, class Store>
void visitParts(Pair& pair, const ContactPair& before, const Store& store) {
  for (const std::size_t side : {0, 1}) {
    store(pair.segment[side], before.segment[side]);
    store(pair.child[side], pair.segment[side]);
    store(pair.parent[side], pair.child[side] - 1);
    store(pair.length_um[side], before.length_um[side]);
    store(pair.type[side], before.type[side]);
    store(pair.t[side], 0.0);
  }
  store(pair.has_unknown_radius, before.has_unknown_radius);
}

}  // namespace

std::uint8_t* encodePairs(std::span<const ContactPair> pairs, std::uint8_t* to) {
  ContactPair before{};
  for (const ContactPair& pair : pairs) {
    std::uint16_t stored = 0, bit = 1;
    std::uint8_t* const begin = to;
    to += sizeof stored;
    const auto put = [&](const auto& value) {
      std::memcpy(to, &value, sizeof value);
      to += sizeof value;
    };
    put(pair.distance_um);
    visitParts(pair, before, [&](const auto& value, std::type_identity_t<decltype(value)> expected) {
      if (value != expected) {
        stored |= bit;
        put(value);
      }
      bit = static_cast<std::uint16_t>(bit << 1);
    });
    std::memcpy(begin, &stored, sizeof stored);
    before = pair;
  }
  return to;
}

void decodePairs(const PairBlock& block, const std::uint8_t* from, std::vector<ContactPair>& pairs) {
  const auto get = [&](auto& value) {
    std::memcpy(&value, from, sizeof value);
    from += sizeof value;
  };
  ContactPair before{};
  for (std::uint32_t i = 0; i < block.pairs; ++i) {
    ContactPair pair{};
    pair.cell = block.cells;
    std::uint16_t stored = 0;
    get(stored);
    get(pair.distance_um);
    visitParts(pair, before, [&](auto& value, std::type_identity_t<std::remove_reference_t<decltype(value)>> expected) {
      if ((stored & 1) != 0)
        get(value);
      else
        value = expected;
      stored = static_cast<std::uint16_t>(stored >> 1);
    });
    pairs.push_back(pair);
    before = pair;
  }
}

}  // namespace filiform::internal
