// Opens the source of a tile set by its name: a folder, or an address on an HTTP server or in an object store.
//
//   const auto set = TileSet::open("https://host/path/column.fil");
//
// An address is http://HOST/v1/sets/NAME, as `filiform serve` serves sets, or that of a set's folder on any server that
// answers Range requests, or s3://BUCKET/PATH/NAME.fil in an object store. The variables and files of AWS give its
// endpoint, region and keys. index/README.md describes them, requests, retries and the disk cache.
#pragma once

#include "index/file/tile_source.h"
#include "index/remote/remote_options.h"

#include <memory>
#include <string>
#include <string_view>

namespace filiform {

// True if the name begins with http://, https:// or s3://, in any letter case.
bool isAddress(std::string_view name);

// Reads over HTTP. Sends no request before the first read. Ranges are asked for as they are read, so a set is read by
// pages and tiles. The directory is read in blocks (RemoteOptions). A file that is read piece after piece is read ahead
// by up to 1 MiB. Throws UsageError for a malformed address or option, or for unusable keys in the environment; IoError
// if the cache's folder or a file with keys cannot be used.
class HttpSource final : public TileSource {
 public:
  explicit HttpSource(const std::string& address, const RemoteOptions& options = {});
  ~HttpSource() override;

  // size() and read() throw IoError with one line that says what is wrong, at which URL, and what to do.
  std::uint64_t size(const std::string& name) const override;
  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override;
  void expect(const std::string& name, std::uint64_t bytes) const override;
  bool isRemote() const override { return true; }
  bool discard(const std::string& name, std::uint64_t offset, std::uint64_t bytes) const override;
  std::string describe(const std::string& name) const override;

  RemoteCounters counters() const;
  std::optional<RemoteCounters> remoteCounters() const override { return counters(); }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// HttpSource for an address, openFolder() for any other name.
std::unique_ptr<TileSource> openSource(const std::string& name, const RemoteOptions& options = {});

}  // namespace filiform
