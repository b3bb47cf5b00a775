// The index of a shard of Neuroglancer skeletons.
//
// A shard begins with its index: 2^minishard_bits pairs of u64, begin and end of each minishard index. A minishard
// index is a table of three rows of u64: ids, offsets and sizes of the objects, ids and offsets as differences. All
// offsets count from the end of the shard index. All numbers are little-endian. Thread rule: pure functions, values.
#pragma once

#include "index/formats/neuroglancer/internal/shard_scheme.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filiform {

struct ShardObject {
  std::uint64_t id = 0, at = 0, bytes = 0;  // place in the file
};

namespace internal {

// Lists the objects of a shard of `file_bytes` bytes. `read(offset, bytes)` fills the bytes from the offset on and may
// throw. Returns an empty text, or what is wrong with the shard: an index or object outside the file, a damaged index,
// an object that belongs to another shard or minishard. `shard`: its number; nullopt: not compared. Indexes of more
// than kMostIndexBytes are refused. O(2^minishard_bits + objects).
inline constexpr std::uint64_t kMostIndexBytes = std::uint64_t{1} << 28;
std::string listShard(const ShardScheme& sharding, std::optional<std::uint64_t> shard, std::uint64_t file_bytes,
                      const std::function<void(std::uint64_t offset, std::span<char> bytes)>& read,
                      std::vector<ShardObject>& objects);

}  // namespace internal
}  // namespace filiform
