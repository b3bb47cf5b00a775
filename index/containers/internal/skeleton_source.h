// Containers of precomputed skeletons: a shard, or the objects of an unsharded source at an address. Their entries are
// named by the ids. Thread rule: as Container.
#pragma once

#include "index/containers/internal/container.h"
#include "index/remote/remote_options.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filiform {

namespace internal {
class HttpClient;
}

// Where the files of skeletons lie. Thread rule: immutable, any thread.
class SkeletonFiles {
 public:
  virtual ~SkeletonFiles() = default;
  // For messages.
  virtual std::string pathOf(const std::string& file) const = 0;
  // Throws IoError; internal::NotOnServer if a server has no such file.
  virtual std::uint64_t size(const std::string& file) const = 0;
  // An open file. Thread rule: thread-compatible.
  class File {
   public:
    virtual ~File() = default;
    virtual void read(std::uint64_t offset, std::span<char> bytes) = 0;  // throws IoError
  };
  virtual std::unique_ptr<File> open(const std::string& file, std::uint64_t bytes) const = 0;
  // Throws IoError, also beyond `most` bytes; internal::NotOnServer if a server has no such file.
  virtual std::string readWhole(const std::string& file, std::uint64_t most) const = 0;
  // The same for a skeleton, which RemoteOptions::cache_folder keeps.
  virtual std::string readObject(const std::string& file, std::uint64_t most) const { return readWhole(file, most); }
  // readWhole(), unpacked if it is gzip data; `most` holds for the content. Throws IoError for damaged gzip data too.
  std::string readText(const std::string& file, std::uint64_t most) const;
  // readText(), or nullopt if there is no such file; also if a server refuses it, as object stores do then.
  std::optional<std::string> findText(const std::string& file, std::uint64_t most) const;

 protected:
  virtual bool isAbsent(const std::string& file) const = 0;  // false if only reading can tell
};

std::shared_ptr<const SkeletonFiles> filesInFolder(std::string folder);
// `address`: of the folder, http, https or s3, without a slash at its end. With RemoteOptions::cache_folder, skeletons
// and shards that were read before come from there, by address and, for shards, size. Throws IoError for a folder that
// cannot be used, UsageError for what RemoteAddress refuses.
std::shared_ptr<const SkeletonFiles> filesAtAddress(const std::string& address, const RemoteOptions& options);

// A shard. With `ids`, in ascending order, only these objects are entries; those that it lacks are refused as
// E_UNREADABLE.
class SkeletonShard final : public Container {
 public:
  // Reads the indexes. Refuses the shard (E_FORMAT, with the reason) if one of them is damaged or points outside the
  // file. Throws IoError.
  SkeletonShard(std::shared_ptr<const SkeletonFiles> files, std::string file, std::shared_ptr<const SkeletonInfo> info,
                const std::vector<std::uint64_t>* ids = nullptr);

  const SkeletonInfo* skeletons() const override { return info_.get(); }
  std::unique_ptr<Reader> reader() const override;

 private:
  void addMissing(const std::vector<std::uint64_t>& ids);

  std::shared_ptr<const SkeletonFiles> files_;
  std::string file_;
  std::shared_ptr<const SkeletonInfo> info_;
};

// The objects `ids` of an unsharded source. An object that the server lacks is refused as E_UNREADABLE.
class SkeletonObjects final : public Container {
 public:
  SkeletonObjects(std::shared_ptr<const SkeletonFiles> files, std::shared_ptr<const SkeletonInfo> info,
                  const std::vector<std::uint64_t>& ids);

  const SkeletonInfo* skeletons() const override { return info_.get(); }
  std::unique_ptr<Reader> reader() const override;

 private:
  std::shared_ptr<const SkeletonFiles> files_;
  std::shared_ptr<const SkeletonInfo> info_;
};

}  // namespace filiform
