#include "index/contacts/internal/pair_codec.h"

#include "index/file/internal/bytes.h"

#include <cstring>
#include <type_traits>

namespace filiform::internal {
namespace {

// Visits what is stored of a pair: store(value, expected) for what is left out if it is as expected. Most segments
// have the rank of their child, and the sample before as the parent; the next pair often has the same segment.
template <class Pair, class Store>
void visitParts(Pair& pair, const ContactPair& before, bool are_counted, const Store& store) {
  for (const std::size_t side : {0, 1}) {
    store(pair.segment[side], before.segment[side]);
    store(pair.child[side], pair.segment[side]);
    store(pair.parent[side], pair.child[side] - 1);
  }
  store(pair.has_unknown_radius, before.has_unknown_radius);
  if (are_counted) return;
  for (const std::size_t side : {0, 1}) {
    store(pair.length_um[side], before.length_um[side]);
    store(pair.type[side], before.type[side]);
    store(pair.t[side], 0.0);
  }
}

// Ranks are near each other: a difference takes 7 bits a byte, lowest first.
void putDifference(std::uint8_t*& to, std::uint32_t value, std::uint32_t expected) {
  std::uint64_t v = zigzag(static_cast<std::int64_t>(value) - expected);
  for (; v >= 128; v >>= 7) *to++ = static_cast<std::uint8_t>(v | 128);
  *to++ = static_cast<std::uint8_t>(v);
}

std::uint32_t getDifference(const std::uint8_t*& from, std::uint32_t expected) {
  std::uint64_t v = *from & 127u;
  for (int shift = 7; *from++ >= 128; shift += 7) v |= static_cast<std::uint64_t>(*from & 127u) << shift;
  return static_cast<std::uint32_t>(expected + unzigzag(v));
}

}  // namespace

std::uint8_t* encodePairs(std::span<const ContactPair> pairs, bool are_counted, std::uint8_t* to) {
  ContactPair before{};
  for (const ContactPair& pair : pairs) {
    std::uint16_t stored = 0, bit = 1;
    std::uint8_t* const begin = to;
    to += are_counted ? 1 : 2;
    const auto put = [&](const auto& value) {
      std::memcpy(to, &value, sizeof value);
      to += sizeof value;
    };
    if (!are_counted) put(pair.distance_um);
    visitParts(pair, before, are_counted, [&](const auto& value, std::type_identity_t<decltype(value)> expected) {
      if (value != expected) {
        stored |= bit;
        if constexpr (std::is_same_v<decltype(value), const std::uint32_t&>)
          putDifference(to, value, expected);
        else
          put(value);
      }
      bit = static_cast<std::uint16_t>(bit << 1);
    });
    std::memcpy(begin, &stored, are_counted ? 1 : 2);
    before = pair;
  }
  return to;
}

void decodePairs(const PairBlock& block, const std::uint8_t* from, bool are_counted, std::vector<ContactPair>& pairs) {
  const auto get = [&](auto& value, std::size_t bytes) {
    std::memcpy(&value, from, bytes);
    from += bytes;
  };
  ContactPair before{};
  for (std::uint32_t i = 0; i < block.pairs; ++i) {
    ContactPair pair{};
    pair.cell = block.cells;
    std::uint16_t stored = 0;
    get(stored, are_counted ? 1 : 2);
    if (!are_counted) get(pair.distance_um, sizeof pair.distance_um);
    visitParts(pair, before, are_counted,
               [&](auto& value, std::type_identity_t<std::remove_reference_t<decltype(value)>> expected) {
                 if ((stored & 1) == 0)
                   value = expected;
                 else if constexpr (std::is_same_v<decltype(value), std::uint32_t&>)
                   value = getDifference(from, expected);
                 else
                   get(value, sizeof value);
                 stored = static_cast<std::uint16_t>(stored >> 1);
               });
    pairs.push_back(pair);
    before = pair;
  }
}

}  // namespace filiform::internal
