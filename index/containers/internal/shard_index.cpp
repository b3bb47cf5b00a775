#include "index/containers/internal/shard_index.h"

#include "index/containers/internal/gunzip.h"
#include "index/file/internal/bytes.h"

#include <algorithm>
#include <string_view>
#include <utility>

namespace filiform {
namespace internal {
namespace {

std::uint64_t numberAt(std::string_view bytes, std::size_t index) {
  return loadLittle64(reinterpret_cast<const std::uint8_t*>(bytes.data()) + 8 * index);
}

constexpr std::uint64_t kMostShardBytes = std::uint64_t{1} << 60;
constexpr std::size_t kObjectBytes = 24, kPairBytes = 16;
constexpr std::uint64_t kFirstIndexPiece = std::uint64_t{1} << 20;
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
    std::string stored, index;
    while (stored.size() < end - begin) {  // a server states the size of the file: memory follows the bytes that come
      const std::uint64_t done = stored.size();
      stored.resize(done + std::min(end - begin - done, std::max(kFirstIndexPiece, done)));
      read_(base_ + begin + done, std::span(stored).subspan(done));
    }
    if (sharding_.gzip_index) {
      if (const auto code = gunzip(stored, kMostIndexBytes, index))
        return "its index cannot be unpacked (" + std::string(name(*code)) + ")";
    } else {
      index = std::move(stored);
    }
    if (index.size() % kObjectBytes != 0) return "its index is not a table of three rows";
    const std::size_t objects = index.size() / kObjectBytes;
    if (objects_.size() + objects > file_bytes_) return "lists more objects than the file has bytes";
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
