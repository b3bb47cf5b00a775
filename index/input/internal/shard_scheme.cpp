#include "index/input/internal/shard_scheme.h"

#include "index/file/internal/bytes.h"
#include "index/input/internal/gunzip.h"

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

std::uint64_t numberAt(std::string_view bytes, std::size_t index) {
  return internal::loadLittle64(reinterpret_cast<const std::uint8_t*>(bytes.data()) + 8 * index);
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

namespace internal {
namespace {

constexpr std::uint64_t kMostShardBytes = std::uint64_t{1} << 60;
constexpr std::size_t kObjectBytes = 24, kPairBytes = 16;
constexpr std::uint64_t kIndexBlock = 4096;  // pairs of the shard index read at once

class ShardListing {
 public:
  using Read = std::function<void(std::uint64_t, std::span<char>)>;
  ShardListing(const ShardScheme& sharding, std::optional<std::uint64_t> shard, std::uint64_t file_bytes,
               const Read& read, std::vector<ShardObject>& objects)
      : sharding_(sharding), shard_(shard), file_bytes_(file_bytes), read_(read), objects_(objects) {}

  std::string list() {
    if (sharding_.minishard_bits > 40 || file_bytes_ > kMostShardBytes ||
        (std::uint64_t{1} << sharding_.minishard_bits) > file_bytes_ / kPairBytes)
      return "is shorter than its index";
    const std::uint64_t minishards = std::uint64_t{1} << sharding_.minishard_bits;
    base_ = minishards * kPairBytes;
    std::string pairs;
    for (std::uint64_t first = 0; first < minishards; first += kIndexBlock) {
      const std::uint64_t some = std::min(kIndexBlock, minishards - first);
      pairs.resize(some * kPairBytes);
      read_(first * kPairBytes, pairs);
      for (std::uint64_t i = 0; i < some; ++i) {
        const std::string wrong = minishard(first + i, numberAt(pairs, 2 * i), numberAt(pairs, 2 * i + 1));
        if (!wrong.empty()) return "minishard " + std::to_string(first + i) + ": " + wrong;
      }
    }
    return {};
  }

 private:
  std::string minishard(std::uint64_t number, std::uint64_t begin, std::uint64_t end) {
    if (begin == end) return {};
    if (begin > end || end > file_bytes_ - base_) return "its index lies outside the file";
    if (end - begin > kMostIndexBytes) return "its index is too large";
    std::string stored(end - begin, '\0'), index;
    read_(base_ + begin, stored);
    if (sharding_.gzip_index) {
      if (const auto code = gunzip(stored, kMostIndexBytes, index))
        return "its index cannot be unpacked (" + std::string(name(*code)) + ")";
    } else {
      index = std::move(stored);
    }
    if (index.size() % kObjectBytes != 0) return "its index is not a table of three rows";
    const std::size_t objects = index.size() / kObjectBytes;
    ShardObject object;
    std::uint64_t at = 0;
    for (std::size_t i = 0; i < objects; ++i) {
      object.id += numberAt(index, i);
      const std::uint64_t step = numberAt(index, objects + i);
      object.bytes = numberAt(index, 2 * objects + i);
      if (step > file_bytes_ - base_ - at || object.bytes > file_bytes_ - base_ - at - step)
        return "object " + std::to_string(object.id) + " lies outside the file";
      at += step;
      object.at = base_ + at;
      at += object.bytes;
      if (sharding_.minishardOf(object.id) != number || (shard_ && sharding_.shardOf(object.id) != *shard_))
        return "object " + std::to_string(object.id) + " belongs to another shard";
      objects_.push_back(object);
    }
    return {};
  }

  const ShardScheme& sharding_;
  const std::optional<std::uint64_t> shard_;
  const std::uint64_t file_bytes_;
  const Read& read_;
  std::vector<ShardObject>& objects_;
  std::uint64_t base_ = 0;  // end of the shard index
};

}  // namespace

std::string listShard(const ShardScheme& sharding, std::optional<std::uint64_t> shard, std::uint64_t file_bytes,
                      const std::function<void(std::uint64_t, std::span<char>)>& read,
                      std::vector<ShardObject>& objects) {
  return ShardListing(sharding, shard, file_bytes, read, objects).list();
}

}  // namespace internal
}  // namespace filiform
