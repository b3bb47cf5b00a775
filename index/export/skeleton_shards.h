// SkeletonShards: which skeletons lie in which file of a sharded folder, and the bytes of these files
// (neuroglancer_uint64_sharded_v1).
//
// A shard has about 32 MiB, a minishard about 64 skeletons. The layout depends only on the numbers and the bytes.
// Thread rule: immutable.
#pragma once

#include "index/export/skeleton_format.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

// The first 8 bytes of MurmurHash3_x86_128 with seed 0 of the number's 8 little-endian bytes.
std::uint64_t murmurHash(std::uint64_t number);

// Compressed by gzip, without name and time, so that the same bytes give the same result. Throws std::bad_alloc.
std::string gzipOf(std::string_view bytes);

class SkeletonShards {
 public:
  // The numbers differ from each other. `bytes`: of all skeletons together, about.
  SkeletonShards(const std::vector<std::uint64_t>& numbers, std::uint64_t bytes);

  SkeletonSharding sharding() const { return sharding_; }
  // The shards that hold skeletons, in the order of their names.
  std::size_t count() const { return shards_.size(); }
  std::string name(std::size_t shard) const;
  // Positions in the list, in the order in which content() of one shard after the other asks for them.
  std::vector<std::size_t> order() const;
  // The content of a shard. Calls skeleton(i) once for each of its numbers, as their position in the list. Exceptions
  // propagate. Holds the whole shard in memory.
  std::string content(std::size_t shard, const std::function<std::string(std::size_t i)>& skeleton) const;

 private:
  struct Member {
    std::uint64_t minishard, number;
    std::size_t i;
  };
  struct Shard {
    std::uint64_t shard;
    std::vector<Member> members;  // by minishard and number
  };
  SkeletonSharding sharding_;
  std::vector<Shard> shards_;
};

}  // namespace filiform::tools
