#include "index/formats/neuroglancer/internal/shard_scheme.h"

#include "index/file/internal/bytes.h"

#include <algorithm>
#include <array>
#include <bit>

namespace filiform {
namespace {

std::uint32_t mixed(std::uint32_t h) {
  h = (h ^ (h >> 16)) * 0x85EBCA6Bu;
  h = (h ^ (h >> 13)) * 0xC2B2AE35u;
  return h ^ (h >> 16);
}

// The lower 64 bits of MurmurHash3_x86_128 of the eight bytes of `key`, seed 0.
std::uint64_t murmurOf(std::uint64_t key) {
  constexpr std::uint32_t kC1 = 0x239B961Bu, kC2 = 0xAB0E9789u, kC3 = 0x38B34AE5u, kLength = 8;
  std::array<std::uint32_t, 4> h{};
  h[0] ^= std::rotl(static_cast<std::uint32_t>(key) * kC1, 15) * kC2;
  h[1] ^= std::rotl(static_cast<std::uint32_t>(key >> 32) * kC2, 16) * kC3;
  for (std::uint32_t& part : h) part ^= kLength;
  const auto spread = [&h] {
    h[0] += h[1] + h[2] + h[3];
    for (std::size_t i = 1; i < h.size(); ++i) h[i] += h[0];
  };
  spread();
  for (std::uint32_t& part : h) part = mixed(part);
  spread();
  return h[0] | std::uint64_t{h[1]} << 32;
}

std::uint64_t shifted(std::uint64_t value, unsigned bits) { return bits >= 64 ? 0 : value >> bits; }
std::uint64_t lowestBits(std::uint64_t value, unsigned bits) {
  return bits >= 64 ? value : value & ((std::uint64_t{1} << bits) - 1);
}

}  // namespace

std::uint64_t ShardScheme::hashOf(std::uint64_t id) const {
  const std::uint64_t key = shifted(id, preshift_bits);
  return murmur ? murmurOf(key) : key;
}

std::uint64_t ShardScheme::minishardOf(std::uint64_t id) const { return lowestBits(hashOf(id), minishard_bits); }
std::uint64_t ShardScheme::shardOf(std::uint64_t id) const {
  return lowestBits(shifted(hashOf(id), minishard_bits), shard_bits);
}

std::string ShardScheme::fileNameOf(std::uint64_t shard) const {
  const std::size_t digits = (shard_bits + 3) / 4;
  const std::string all = internal::hex16(shard);
  return all.substr(all.size() - std::max<std::size_t>(digits, 1)) + ".shard";
}

std::optional<std::uint64_t> ShardScheme::shards() const {
  return shard_bits > 63 ? std::nullopt : std::optional(std::uint64_t{1} << shard_bits);
}

}  // namespace filiform
