// SlowFolder: a folder whose reads of tiles take some time; counts them, those under way, and their rounds. Thread
// rule: internally synchronised; set `fail_at` and `wait_ms` before use.
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
  SlowFolder(const std::string& path, bool remote)
      : wait_ms(remote ? 20 : 1), source_(openFolder(path)), remote_(remote) {}
  std::uint64_t size(const std::string& name) const override { return source_->size(name); }
  std::string describe(const std::string& name) const override { return source_->describe(name); }
  bool isRemote() const override { return remote_; }
  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override {
    if (name.ends_with(".pack")) {
      raise(most_under_way, ++under_way);
      const int round = rounds + 1;
      if (++reads == fail_at) throw IoError(describe(name), "an injected fault");
      std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
      --under_way;
      raise(rounds, round);
    }
    source_->read(name, offset, bytes);
  }
  mutable std::atomic<int> under_way{0}, most_under_way{0}, reads{0};
  mutable std::atomic<int> rounds{0};  // the longest chain of reads, each begun after the end of the one before
  int fail_at = 0;
  int wait_ms;  // of a read

 private:
  static void raise(std::atomic<int>& most, int value) {
    for (int before = most; value > before && !most.compare_exchange_weak(before, value);) continue;
  }
  std::unique_ptr<TileSource> source_;
  bool remote_;
};

}  // namespace filiform::test
