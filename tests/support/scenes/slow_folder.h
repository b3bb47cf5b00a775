// SlowFolder: a folder whose reads of tiles take some time; counts them, and those under way. Thread rule: internally
// synchronised; set `fail_at` before use.
#pragma once

#include "index/errors.h"
#include "index/file/tile_source.h"

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>

namespace filiform::test {

class SlowFolder final : public TileSource {
 public:
  SlowFolder(const std::string& path, bool remote) : source_(openFolder(path)), remote_(remote) {}
  std::uint64_t size(const std::string& name) const override { return source_->size(name); }
  std::string describe(const std::string& name) const override { return source_->describe(name); }
  bool isRemote() const override { return remote_; }
  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override {
    if (name.ends_with(".pack")) {
      const int now = ++under_way;
      for (int most = most_under_way; now > most && !most_under_way.compare_exchange_weak(most, now);) {
      }
      if (++reads == fail_at) throw IoError(describe(name), "an injected fault");
      std::this_thread::sleep_for(std::chrono::milliseconds(remote_ ? 20 : 1));
      --under_way;
    }
    source_->read(name, offset, bytes);
  }
  mutable std::atomic<int> under_way{0}, most_under_way{0}, reads{0};
  int fail_at = 0;

 private:
  std::unique_ptr<TileSource> source_;
  bool remote_;
};

}  // namespace filiform::test
