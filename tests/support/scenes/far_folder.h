// FarFolder: a folder that says it is at an address. Counts reads of the directory, and those of the thread that made
// the object. Thread rule: internally synchronised.
#pragma once

#include "index/file/tile_source.h"

#include <atomic>
#include <memory>
#include <string>
#include <thread>

namespace filiform::test {

class FarFolder final : public TileSource {
 public:
  explicit FarFolder(const std::string& path) : source_(openFolder(path)) {}
  std::uint64_t size(const std::string& name) const override { return source_->size(name); }
  std::string describe(const std::string& name) const override { return source_->describe(name); }
  bool isRemote() const override { return true; }
  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override {
    if (name.ends_with("directory.bin")) {
      ++directory_reads;
      if (std::this_thread::get_id() == maker_) ++directory_reads_here;
    }
    source_->read(name, offset, bytes);
  }
  mutable std::atomic<int> directory_reads{0}, directory_reads_here{0};

 private:
  std::unique_ptr<TileSource> source_;
  std::thread::id maker_ = std::this_thread::get_id();
};

}  // namespace filiform::test
