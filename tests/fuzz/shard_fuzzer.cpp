#include "index/containers/internal/shard_index.h"
#include "tests/fuzz/fuzz_bytes.h"

#include <algorithm>
#include <cstring>

namespace filiform::fuzz {

// A shard: the first bytes choose the sharding, the others are the file.
void fuzzShard(Input input) {
  Taker in(input);
  ShardScheme sharding;
  sharding.preshift_bits = in.number<std::uint8_t>() % 65;
  sharding.minishard_bits = in.number<std::uint8_t>() % 8;
  sharding.shard_bits = in.number<std::uint8_t>() % 57;
  const auto flags = in.number<std::uint8_t>();
  sharding.murmur = (flags & 1) != 0;
  sharding.gzip_index = (flags & 2) != 0;
  const std::optional<std::uint64_t> shard = (flags & 4) != 0 ? std::optional<std::uint64_t>(0) : std::nullopt;
  const std::string_view file = asText(in.rest());
  std::vector<ShardObject> objects;
  const std::string wrong = internal::listShard(
      sharding, shard, file.size(),
      [&](std::uint64_t offset, std::span<char> bytes) {
        require(offset <= file.size() && bytes.size() <= file.size() - offset, "nothing is read beyond the file");
        std::copy_n(file.data() + offset, bytes.size(), bytes.data());
      },
      objects);
  for (const ShardObject& object : objects) {
    require(object.at <= file.size() && object.bytes <= file.size() - object.at, "objects lie inside the file");
    require(!shard || sharding.shardOf(object.id) == *shard, "objects belong to the shard");
  }
  for (const char c : wrong) require(c >= ' ' && c < 127, "the reason is plain text");
}

}  // namespace filiform::fuzz
