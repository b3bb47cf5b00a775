// Sharded Neuroglancer skeletons (neuroglancer_uint64_sharded_v1): many objects in one file (shard_index.h). An id's
// hash gives its minishard (the lowest bits) and its shard (the next ones). Thread rule: values.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace filiform {

struct ShardScheme {
  unsigned preshift_bits = 0, minishard_bits = 0, shard_bits = 0;  // each at most 64; the last two together too
  bool murmur = false;                                             // murmurhash3_x86_128; else identity
  bool gzip_index = false, gzip_data = false;

  std::uint64_t shardOf(std::uint64_t id) const;
  std::uint64_t minishardOf(std::uint64_t id) const;
  // The shard's number in hexadecimal digits, all of one length, and `.shard`.
  std::string fileNameOf(std::uint64_t shard) const;
  // 2^shard_bits; nullopt beyond 2^63.
  std::optional<std::uint64_t> shards() const;

 private:
  std::uint64_t hashOf(std::uint64_t id) const;
};

}  // namespace filiform
