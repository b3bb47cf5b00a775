#include "index/containers/internal/skeleton_source.h"

#include "index/containers/internal/gunzip.h"
#include "index/containers/internal/shard_index.h"
#include "index/errors.h"
#include "index/file/internal/digest.h"
#include "index/file/internal/file_parts.h"
#include "index/remote/internal/http_client.h"
#include "index/remote/internal/http_errors.h"
#include "index/remote/internal/range_cache.h"
#include "index/remote/internal/remote_address.h"
#include "index/remote/internal/url_origin.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <set>
#include <system_error>
#include <utility>

namespace filiform {
namespace {

class FolderFiles final : public SkeletonFiles {
 public:
  explicit FolderFiles(std::string folder) : folder_(std::move(folder)) {}

  std::string pathOf(const std::string& file) const override {
    return (std::filesystem::path(folder_) / file).native();
  }
  std::uint64_t size(const std::string& file) const override {
    std::error_code error;
    const std::uint64_t bytes = std::filesystem::file_size(pathOf(file), error);
    if (error) throw IoError(inShort(pathOf(file)), "cannot read", error.value());
    return bytes;
  }
  std::unique_ptr<File> open(const std::string& file, std::uint64_t bytes) const override {
    return std::make_unique<Part>(pathOf(file), bytes);
  }
  std::string readWhole(const std::string& file, std::uint64_t most) const override {
    const std::uint64_t bytes = size(file);
    if (bytes > most) throw IoError(inShort(pathOf(file)), "has more than " + std::to_string(most) + " bytes");
    std::string text(bytes, '\0');
    open(file, bytes)->read(0, text);
    return text;
  }

 protected:
  bool isAbsent(const std::string& file) const override {
    std::error_code error;
    return !std::filesystem::exists(pathOf(file), error) && !error;
  }

 private:
  struct Part final : File {
    Part(const std::string& path, std::uint64_t bytes) : parts(path, bytes) {}
    void read(std::uint64_t offset, std::span<char> bytes) override { parts.read(offset, bytes); }
    internal::FileParts parts;
  };
  const std::string folder_;
};

class AddressFiles final : public SkeletonFiles {
 public:
  AddressFiles(std::string address, std::shared_ptr<const internal::S3Account> account, const RemoteOptions& options)
      : address_(std::move(address)),
        client_(std::make_shared<internal::HttpClient>(internal::originOf(address_), options, std::move(account))) {
    if (!options.cache_folder.empty())
      cache_ = std::make_shared<internal::RangeCache>(options.cache_folder, options.cache_bytes);
  }

  std::string pathOf(const std::string& file) const override { return address_ + "/" + file; }
  std::uint64_t size(const std::string& file) const override { return client_->size(pathOf(file)); }
  std::unique_ptr<File> open(const std::string& file, std::uint64_t bytes) const override {
    return std::make_unique<Part>(client_, cache_, pathOf(file), bytes);
  }
  std::string readWhole(const std::string& file, std::uint64_t most) const override {
    const internal::Bytes bytes = client_->readWhole(pathOf(file), most);
    return {bytes.begin(), bytes.end()};
  }
  std::string readObject(const std::string& file, std::uint64_t most) const override {
    if (cache_ == nullptr) return readWhole(file, most);
    const std::string key = pathOf(file) + "@0", size_key = pathOf(file) + "@size";
    std::uint64_t size = 0;
    const std::span<std::uint8_t> size_bytes(reinterpret_cast<std::uint8_t*>(&size), sizeof size);
    if (cache_->get(size_key, size_bytes) && size <= most) {
      std::string bytes(size, '\0');
      if (cache_->get(key, {reinterpret_cast<std::uint8_t*>(bytes.data()), bytes.size()})) return bytes;
    }
    std::string bytes = readWhole(file, most);
    size = bytes.size();
    cache_->put(key, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    cache_->put(size_key, size_bytes);
    return bytes;
  }

 protected:
  bool isAbsent(const std::string&) const override { return false; }

 private:
  struct Part final : File {
    Part(std::shared_ptr<internal::HttpClient> http, std::shared_ptr<internal::RangeCache> kept, std::string address,
         std::uint64_t size)
        : client(std::move(http)), cache(std::move(kept)), url(std::move(address)), file_bytes(size) {}
    void read(std::uint64_t offset, std::span<char> bytes) override {
      if (bytes.empty()) return;
      const std::span<std::uint8_t> part(reinterpret_cast<std::uint8_t*>(bytes.data()), bytes.size());
      const std::string key = url + "#" + std::to_string(file_bytes) + "@" + std::to_string(offset);
      if (cache != nullptr && cache->get(key, part)) return;
      client->readRange(url, offset, part);
      if (cache != nullptr) cache->put(key, part);
    }
    const std::shared_ptr<internal::HttpClient> client;
    const std::shared_ptr<internal::RangeCache> cache;
    const std::string url;
    const std::uint64_t file_bytes;
  };
  const std::string address_;
  const std::shared_ptr<internal::HttpClient> client_;
  std::shared_ptr<internal::RangeCache> cache_;
};

ArchiveEntry entryOfObject(std::uint64_t id) {
  ArchiveEntry entry;
  entry.name = std::to_string(id);
  entry.format = GraphFormat::kNeuroglancerSkeleton;
  return entry;
}

std::optional<std::uint64_t> numberOfShard(const std::string& file) {
  std::uint64_t number = 0;
  const char* const end = file.data() + file.find('.');
  const auto [stop, error] = std::from_chars(file.data(), end, number, 16);
  return error == std::errc() && stop == end ? std::optional(number) : std::nullopt;
}

class ShardReader final : public Container::Reader {
 public:
  ShardReader(std::shared_ptr<const SkeletonFiles> files, std::string file, std::uint64_t bytes, bool packed)
      : files_(std::move(files)), file_(std::move(file)), bytes_(bytes), packed_(packed) {}

  std::optional<InputCode> read(const ArchiveEntry& entry, const Sink& sink) override {
    if (entry.packed_bytes > Container::kMaxEntryBytes) return InputCode::E_ZIP_SIZE;
    if (entry.packed_bytes == 0) throw IoError(inShort(entry.name), "is not in its shard");
    if (!open_) open_ = files_->open(file_, bytes_);
    internal::Gunzip unpacked;
    constexpr std::uint64_t kBlock = std::uint64_t{1} << 20;
    std::string block;
    for (std::uint64_t done = 0; done < entry.packed_bytes; done += block.size()) {
      block.resize(static_cast<std::size_t>(std::min(kBlock, entry.packed_bytes - done)));
      open_->read(entry.index + done, block);
      if (!packed_)
        sink(block);
      else if (const auto wrong = unpacked.feed(block, sink))
        return wrong;
    }
    return packed_ ? unpacked.finish() : std::nullopt;
  }

 private:
  const std::shared_ptr<const SkeletonFiles> files_;
  const std::string file_;
  const std::uint64_t bytes_;
  const bool packed_;
  std::unique_ptr<SkeletonFiles::File> open_;
};

class ObjectReader final : public Container::Reader {
 public:
  ObjectReader(std::shared_ptr<const SkeletonFiles> files, std::shared_ptr<const SkeletonInfo> info)
      : files_(std::move(files)), info_(std::move(info)) {}

  std::optional<InputCode> read(const ArchiveEntry& entry, const Sink& sink) override {
    const std::string bytes = readObject(entry.name);
    if (!info_->isGzip(bytes, bytes.size())) {
      sink(bytes);
      return std::nullopt;
    }
    internal::Gunzip unpacked;
    std::uint64_t content = 0;
    bool too_long = false;
    const auto wrong = unpacked.feed(bytes, [&](std::string_view block) {
      content += block.size();
      too_long = too_long || content > kMostObject;
      if (!too_long) sink(block);
    });
    if (too_long) return InputCode::E_ZIP_SIZE;
    return wrong ? wrong : unpacked.finish();
  }

 private:
  std::string readObject(const std::string& name) const {
    try {
      return files_->readObject(name, kMostObject);
    } catch (const internal::NotOnServer& missing) {
      const std::string reason = missing.reason();
      throw IoError(inShort(files_->pathOf(name)), reason.substr(0, reason.find(';')));
    }
  }

  static constexpr std::uint64_t kMostObject = std::uint64_t{1} << 30;
  const std::shared_ptr<const SkeletonFiles> files_;
  const std::shared_ptr<const SkeletonInfo> info_;
};

}  // namespace

std::string SkeletonFiles::readText(const std::string& file, std::uint64_t most) const {
  std::string bytes = readWhole(file, most), text;
  if (!bytes.starts_with("\x1f\x8b")) return bytes;
  const auto wrong = internal::gunzip(bytes, most, text);
  if (wrong == InputCode::E_ZIP_SIZE)
    throw IoError(inShort(pathOf(file)), "has more than " + std::to_string(most) + " bytes");
  if (wrong) throw IoError(inShort(pathOf(file)), "is gzip data, but " + std::string(explanation(*wrong)));
  return text;
}

std::optional<std::string> SkeletonFiles::findText(const std::string& file, std::uint64_t most) const {
  if (isAbsent(file)) return std::nullopt;
  try {
    return readText(file, most);
  } catch (const internal::NotOnServer&) {
    return std::nullopt;
  } catch (const internal::DeniedByServer&) {
    return std::nullopt;
  }
}

std::shared_ptr<const SkeletonFiles> filesInFolder(std::string folder) {
  return std::make_shared<FolderFiles>(std::move(folder));
}

std::shared_ptr<const SkeletonFiles> filesAtAddress(const std::string& address, const RemoteOptions& options) {
  const internal::RemoteAddress place(address);
  return std::make_shared<AddressFiles>(place.set, place.account, options);
}

SkeletonShard::SkeletonShard(std::shared_ptr<const SkeletonFiles> files, std::string file,
                             std::shared_ptr<const SkeletonInfo> info, const std::vector<std::uint64_t>* ids)
    : files_(std::move(files)), file_(std::move(file)), info_(std::move(info)) {
  file_bytes_ = files_->size(file_);
  const std::unique_ptr<SkeletonFiles::File> open = files_->open(file_, file_bytes_);
  internal::RunningDigest digest;
  std::vector<ShardObject> objects;
  constexpr std::uint64_t kReadAtOnce = 128 << 10;
  std::string block;
  std::uint64_t block_at = 0;
  const std::string wrong = internal::listShard(
      *info_->sharding, numberOfShard(file_), file_bytes_,
      [&](std::uint64_t offset, std::span<char> bytes) {
        // The indexes of minishards mostly follow each other: they come in blocks, for a request takes long.
        if (offset < block_at || offset + bytes.size() > block_at + block.size()) {
          block_at = offset;
          block.resize(std::max<std::uint64_t>(bytes.size(), std::min(kReadAtOnce, file_bytes_ - offset)));
          open->read(offset, block);
        }
        std::copy_n(block.begin() + static_cast<std::ptrdiff_t>(offset - block_at), bytes.size(), bytes.begin());
        digest.add(std::string_view(bytes.data(), bytes.size()));
      },
      objects);
  digest_ = digest.value();
  if (!wrong.empty()) {
    refuse(InputCode::E_FORMAT, wrong);
    return;
  }
  for (const ShardObject& object : objects) {
    if (ids != nullptr && !std::binary_search(ids->begin(), ids->end(), object.id)) continue;
    ArchiveEntry entry = entryOfObject(object.id);
    entry.index = object.at;
    entry.packed_bytes = object.bytes;
    entry.bytes = info_->sharding->gzip_data ? 0 : object.bytes;
    entries_.push_back(std::move(entry));
  }
  if (ids != nullptr) addMissing(*ids);
  finishListing();
}

// Entries for the wanted objects that this shard should hold but does not.
void SkeletonShard::addMissing(const std::vector<std::uint64_t>& ids) {
  std::set<std::string> found;
  for (const ArchiveEntry& entry : entries_) found.insert(entry.name);
  const std::optional<std::uint64_t> number = numberOfShard(file_);
  for (const std::uint64_t id : ids)
    if (number && info_->sharding->shardOf(id) == *number && !found.contains(std::to_string(id)))
      entries_.push_back(entryOfObject(id));
}

std::unique_ptr<Container::Reader> SkeletonShard::reader() const {
  return std::make_unique<ShardReader>(files_, file_, file_bytes_, info_->sharding->gzip_data);
}

SkeletonObjects::SkeletonObjects(std::shared_ptr<const SkeletonFiles> files, std::shared_ptr<const SkeletonInfo> info,
                                 const std::vector<std::uint64_t>& ids)
    : files_(std::move(files)), info_(std::move(info)) {
  internal::RunningDigest digest;
  for (const std::uint64_t id : ids) {
    entries_.push_back(entryOfObject(id));
    digest.add(entries_.back().name + "\n");
  }
  digest_ = digest.value();
  finishListing();
}

std::unique_ptr<Container::Reader> SkeletonObjects::reader() const {
  return std::make_unique<ObjectReader>(files_, info_);
}

}  // namespace filiform
