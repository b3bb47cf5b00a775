#include "index/remote/http_source.h"

#include "index/errors.h"
#include "index/file/internal/set_files.h"
#include "index/remote/internal/background_reads.h"
#include "index/remote/internal/http_client.h"
#include "index/remote/internal/range_ahead.h"
#include "index/remote/internal/range_cache.h"
#include "index/remote/internal/remote_address.h"
#include "index/text.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <future>
#include <list>
#include <map>
#include <mutex>
#include <optional>

namespace filiform {
namespace {

// Larger reads are those of whole files, which verify and copies make.
constexpr std::uint64_t kMostCachedRead = std::uint64_t{1} << 20;

// Pages of the directory that a place needs lie close together in the file: they are read in blocks, some of which stay
// in memory.
constexpr std::uint64_t kLeastBlock = 4 << 10, kBytesOfBlocks = 16 << 20;

bool isDirectory(const std::string& name) { return name.ends_with(std::string("/") + internal::kDirectoryFile); }

// Files that are read at once, when their size is first asked for.
bool isSmallFile(const std::string& name) {
  return name == internal::kCurrentFile || name.ends_with(std::string("/") + internal::kManifestFile);
}

}  // namespace

bool isAddress(std::string_view name) {
  return endsWithNoCase(name.substr(0, 7), "http://") || endsWithNoCase(name.substr(0, 8), "https://") ||
         internal::isS3Address(name);
}

struct HttpSource::Impl {
  const internal::RemoteAddress address;
  mutable internal::HttpClient client;
  std::unique_ptr<internal::RangeCache> cache;
  mutable std::atomic<std::uint64_t> cache_hits{0};
  mutable internal::RangeAhead ahead;
  std::mutex mutex;                               // guards the members below
  std::map<std::string, internal::Bytes> small;   // read for size(), until read() takes all of it
  std::map<std::string, std::uint64_t> expected;  // sizes of files
  struct Block {
    std::string key;
    std::shared_ptr<const internal::Bytes> bytes;
  };
  std::list<Block> blocks;  // of directories, most recently used first
  std::map<std::string, std::shared_future<std::shared_ptr<const internal::Bytes>>> blocks_read_now;  // by key

  const std::uint64_t block_bytes;

  Impl(const std::string& text, const RemoteOptions& options)
      : address(text),
        client(address.origin, options, address.account),
        block_bytes(std::max(options.directory_block_bytes, kLeastBlock)) {
    if (!options.cache_folder.empty())
      cache = std::make_unique<internal::RangeCache>(options.cache_folder, options.cache_bytes);
  }
  std::string url(const std::string& name) const {
    if (!isTileFileName(name)) throw UsageError("not the name of a file in a tile set");
    return address.files + name;
  }
  // Reads all of a small file. Manifests come from the cache on disk if they are there: only CURRENT changes.
  internal::Bytes fetch(const std::string& name) const;
  // Reads from the server, more than asked for if the file is read piece after piece.
  void readRange(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes);
  // Reads from the cache on disk, or else from the server.
  void readKept(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes);
  // Reads in blocks, in a file of known size. Requires that the range lies in the file.
  void readBlocks(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes,
                  std::uint64_t file_bytes);
  std::shared_ptr<const internal::Bytes> block(const std::string& name, std::uint64_t begin, std::uint64_t size);
  std::uint64_t expectedSize(const std::string& name) {  // 0: unknown
    const std::lock_guard lock(mutex);
    const auto stated = expected.find(name);
    return stated != expected.end() ? stated->second : 0;
  }
  bool isKept(const std::string& name, std::uint64_t bytes) const {
    return cache != nullptr && !isSmallFile(name) && bytes > 0 && bytes <= kMostCachedRead;
  }
  std::string key(const std::string& name, std::uint64_t offset) const {
    return url(name) + "@" + std::to_string(offset);
  }
};

internal::Bytes HttpSource::Impl::fetch(const std::string& name) const {
  if (name == internal::kCurrentFile) return client.readWhole(url(name), internal::kMostCurrentBytes);
  const std::string size_key = url(name) + "@size";
  std::uint64_t size = 0;
  const std::span<std::uint8_t> size_bytes(reinterpret_cast<std::uint8_t*>(&size), sizeof size);
  if (cache != nullptr && cache->get(size_key, size_bytes) && size <= internal::kMostManifestBytes) {
    internal::Bytes bytes(size);
    if (cache->get(key(name, 0), bytes)) {
      ++cache_hits;
      return bytes;
    }
  }
  internal::Bytes bytes = client.readWhole(url(name), internal::kMostManifestBytes);
  size = bytes.size();
  if (cache != nullptr) {
    cache->put(key(name, 0), bytes);
    cache->put(size_key, size_bytes);
  }
  return bytes;
}

void HttpSource::Impl::readRange(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) {
  if (ahead.take(name, offset, bytes)) return;
  const std::uint64_t size = ahead.plan(name, offset, bytes.size(), expectedSize(name));
  if (size == bytes.size()) return client.readRange(url(name), offset, bytes);
  internal::Bytes piece(size);
  client.readRange(url(name), offset, piece);
  std::memcpy(bytes.data(), piece.data(), bytes.size());
  ahead.keep(name, offset, std::move(piece));
}

void HttpSource::Impl::readKept(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) {
  const bool kept = isKept(name, bytes.size());
  if (kept && cache->get(key(name, offset), bytes)) {
    ++cache_hits;
    return;
  }
  readRange(name, offset, bytes);
  if (kept) cache->put(key(name, offset), bytes);
}

void HttpSource::Impl::readBlocks(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes,
                                  std::uint64_t file_bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const std::uint64_t at = offset + done, begin = at / block_bytes * block_bytes;
    const auto from = block(name, begin, std::min(block_bytes, file_bytes - begin));
    const std::size_t part = std::min<std::size_t>(bytes.size() - done, begin + from->size() - at);
    std::memcpy(bytes.data() + done, from->data() + (at - begin), part);
    done += part;
  }
}

std::shared_ptr<const internal::Bytes> HttpSource::Impl::block(const std::string& name, std::uint64_t begin,
                                                               std::uint64_t size) {
  const std::string wanted = key(name, begin);
  std::promise<std::shared_ptr<const internal::Bytes>> promise;
  {
    std::unique_lock lock(mutex);
    for (auto at = blocks.begin(); at != blocks.end(); ++at) {
      if (at->key != wanted) continue;
      blocks.splice(blocks.begin(), blocks, at);
      return at->bytes;
    }
    const auto [at, first] = blocks_read_now.try_emplace(wanted);
    if (!first) {  // pages of one block are often wanted by several threads at once
      const auto other = at->second;
      lock.unlock();
      return other.get();
    }
    at->second = promise.get_future().share();
  }
  // Everything waits for the directory, so its reads are never of the background.
  const internal::BackgroundReads foreground(false);
  auto read = std::make_shared<internal::Bytes>(size);
  try {
    readKept(name, begin, *read);
  } catch (...) {
    promise.set_exception(std::current_exception());
    const std::lock_guard lock(mutex);
    blocks_read_now.erase(wanted);
    throw;
  }
  promise.set_value(read);
  const std::lock_guard lock(mutex);
  blocks_read_now.erase(wanted);
  blocks.push_front({wanted, read});
  if (blocks.size() * block_bytes > kBytesOfBlocks) blocks.pop_back();
  return read;
}

HttpSource::HttpSource(const std::string& address, const RemoteOptions& options)
    : impl_(std::make_unique<Impl>(address, options)) {}
HttpSource::~HttpSource() = default;

std::uint64_t HttpSource::size(const std::string& name) const {
  if (!isSmallFile(name)) return impl_->client.size(impl_->url(name));
  internal::Bytes bytes = impl_->fetch(name);
  const std::uint64_t size = bytes.size();
  const std::lock_guard lock(impl_->mutex);
  impl_->small[name] = std::move(bytes);
  return size;
}

void HttpSource::read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const {
  if (isSmallFile(name)) {
    std::optional<internal::Bytes> file;
    {
      const std::lock_guard lock(impl_->mutex);
      const auto found = impl_->small.find(name);
      if (found != impl_->small.end()) {
        file = std::move(found->second);
        impl_->small.erase(found);
      }
    }
    if (!file) file = impl_->fetch(name);
    if (offset > file->size() || bytes.size() > file->size() - offset)
      throw CorruptSet(describe(name), file->size(), "the file ends here");
    if (!bytes.empty()) std::memcpy(bytes.data(), file->data() + offset, bytes.size());
    return;
  }
  const std::uint64_t file_bytes = isDirectory(name) ? impl_->expectedSize(name) : 0;
  if (offset <= file_bytes && bytes.size() <= file_bytes - offset && bytes.size() <= impl_->block_bytes)
    impl_->readBlocks(name, offset, bytes, file_bytes);
  else
    impl_->readKept(name, offset, bytes);
}

bool HttpSource::discard(const std::string& name, std::uint64_t offset, std::uint64_t bytes) const {
  if (impl_->cache != nullptr && (isSmallFile(name) || impl_->isKept(name, bytes)))
    impl_->cache->remove(impl_->key(name, offset));
  const std::uint64_t block = impl_->block_bytes;
  if (impl_->cache != nullptr && isDirectory(name))
    for (std::uint64_t at = offset / block * block; at < offset + bytes; at += block)
      impl_->cache->remove(impl_->key(name, at));
  impl_->ahead.forget();
  const std::lock_guard lock(impl_->mutex);
  impl_->blocks.clear();
  return true;
}

void HttpSource::expect(const std::string& name, std::uint64_t bytes) const {
  const std::lock_guard lock(impl_->mutex);
  impl_->expected[name] = bytes;
}

std::string HttpSource::describe(const std::string& name) const { return escaped(impl_->address.files + name); }

RemoteCounters HttpSource::counters() const {
  RemoteCounters counters = impl_->client.counters();
  counters.cache_hits = impl_->cache_hits;
  return counters;
}

std::unique_ptr<TileSource> openSource(const std::string& name, const RemoteOptions& options) {
  if (isAddress(name)) return std::make_unique<HttpSource>(name, options);
  return openFolder(name);
}

}  // namespace filiform
