#include "index/export/skeleton_shards.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <new>
#include <tuple>
#include <zlib.h>

namespace filiform::tools {

namespace {

constexpr std::uint64_t kShardBytes = 32 << 20;
constexpr std::size_t kMinishardSkeletons = 64;
constexpr int kMostShardBits = 16, kMostMinishardBits = 16;

std::uint32_t finalMix(std::uint32_t h) {
  h = (h ^ h >> 16) * 0x85ebca6bU;
  h = (h ^ h >> 13) * 0xc2b2ae35U;
  return h ^ h >> 16;
}

void putWord(std::string& bytes, std::uint64_t word) {
  for (int i = 0; i < 8; ++i) bytes += static_cast<char>(word >> (8 * i) & 0xff);
}

// The least bits so that 2^bits * each >= all.
int bitsFor(std::uint64_t all, std::uint64_t each, int most) {
  int bits = 0;
  while (bits < most && (each << bits) < all) ++bits;
  return bits;
}

}  // namespace

// The input has 8 bytes: only the tail of the algorithm, of 16-byte blocks there are none.
std::uint64_t murmurHash(std::uint64_t number) {
  constexpr std::uint32_t kC1 = 0x239b961bU, kC2 = 0xab0e9789U, kC3 = 0x38b34ae5U;
  constexpr std::uint32_t kBytes = 8;
  std::uint32_t h1 = std::rotl(static_cast<std::uint32_t>(number) * kC1, 15) * kC2;
  std::uint32_t h2 = std::rotl(static_cast<std::uint32_t>(number >> 32) * kC2, 16) * kC3;
  std::uint32_t h3 = kBytes, h4 = kBytes;
  h1 ^= kBytes, h2 ^= kBytes;
  h1 += h2 + h3 + h4;
  h2 += h1, h3 += h1, h4 += h1;
  h1 = finalMix(h1), h2 = finalMix(h2), h3 = finalMix(h3), h4 = finalMix(h4);
  h1 += h2 + h3 + h4;
  h2 += h1;
  return std::uint64_t{h2} << 32 | h1;
}

std::string gzipOf(std::string_view bytes) {
  constexpr int kGzip = 15 + 16;  // the largest window, gzip header
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzip, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  std::string packed;
  std::array<char, 1 << 16> piece{};
  std::size_t at = 0;
  int state = Z_OK;
  while (state != Z_STREAM_END) {
    if (stream.avail_in == 0 && at < bytes.size()) {
      const std::size_t some = std::min<std::size_t>(bytes.size() - at, std::size_t{1} << 30);
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data() + at));
      stream.avail_in = static_cast<uInt>(some);
      at += some;
    }
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = static_cast<uInt>(piece.size());
    state = deflate(&stream, at == bytes.size() ? Z_FINISH : Z_NO_FLUSH);
    packed.append(piece.data(), piece.size() - stream.avail_out);
  }
  deflateEnd(&stream);
  return packed;
}

SkeletonShards::SkeletonShards(const std::vector<std::uint64_t>& numbers, std::uint64_t bytes) {
  sharding_.shard_bits = bitsFor(bytes, kShardBytes, kMostShardBits);
  sharding_.minishard_bits = bitsFor(numbers.size() >> sharding_.shard_bits, kMinishardSkeletons, kMostMinishardBits);
  struct Place {
    std::uint64_t shard;
    Member member;
  };
  std::vector<Place> places;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::uint64_t hash = murmurHash(numbers[i]);
    const std::uint64_t minishard = hash & ((std::uint64_t{1} << sharding_.minishard_bits) - 1);
    const std::uint64_t shard = hash >> sharding_.minishard_bits & ((std::uint64_t{1} << sharding_.shard_bits) - 1);
    places.push_back({shard, {minishard, numbers[i], i}});
  }
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return std::tie(a.shard, a.member.minishard, a.member.number) <
           std::tie(b.shard, b.member.minishard, b.member.number);
  });
  for (const Place& place : places) {
    if (shards_.empty() || shards_.back().shard != place.shard) shards_.push_back({place.shard, {}});
    shards_.back().members.push_back(place.member);
  }
}

std::string SkeletonShards::name(std::size_t shard) const {
  char text[24];
  const int digits = (sharding_.shard_bits + 3) / 4;
  std::snprintf(text, sizeof text, "%0*llx.shard", digits, static_cast<unsigned long long>(shards_.at(shard).shard));
  return text;
}

std::vector<std::size_t> SkeletonShards::order() const {
  std::vector<std::size_t> order;
  for (const Shard& shard : shards_)
    for (const Member& member : shard.members) order.push_back(member.i);
  return order;
}

std::string SkeletonShards::content(std::size_t shard,
                                    const std::function<std::string(std::size_t i)>& skeleton) const {
  // The index of a minishard, before it is compressed: all numbers, all places, all sizes. Numbers are written as
  // differences; a place as the gap after the skeleton before. Places count from the end of the shard's index.
  struct Index {
    std::vector<std::uint64_t> numbers, gaps, sizes;
    std::uint64_t number = 0, end = 0;
  };
  std::vector<Index> indices(std::size_t{1} << sharding_.minishard_bits);
  std::string data;
  for (const Member& member : shards_.at(shard).members) {
    const std::string packed = gzipOf(skeleton(member.i));
    Index& index = indices[member.minishard];
    index.numbers.push_back(member.number - index.number);
    index.gaps.push_back(data.size() - index.end);
    index.sizes.push_back(packed.size());
    data += packed;
    index.number = member.number;
    index.end = data.size();
  }
  std::string head;
  for (const Index& index : indices) {
    std::string words;
    for (const auto* const list : {&index.numbers, &index.gaps, &index.sizes})
      for (const std::uint64_t word : *list) putWord(words, word);
    putWord(head, data.size());
    if (!words.empty()) data += gzipOf(words);
    putWord(head, data.size());
  }
  return head + data;
}

}  // namespace filiform::tools
