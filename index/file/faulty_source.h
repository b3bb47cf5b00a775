// A source of bytes that delays reads or fails on demand: for tests, and to try a set as if on a slow or damaged disk.
//
//   auto source = std::make_unique<FaultySource>(openFolder(path), FaultPlan{.delay = FaultPlan::Delay::constant,
//                                                                           .delay_s = 0.02});
//   FaultySource& faults = *source;
//   const auto set = TileSet::open(std::move(source));
//   faults.arm();  // faults start here
//
// The fault of a read depends only on the seed, the position and how often that position was read before. Threads and
// time have no effect. Only `fail_every` counts reads in their order of arrival. Thread rule: internally synchronised.
#pragma once

#include "index/file/tile_source.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <vector>

namespace filiform {

// What FaultySource injects.
struct FaultPlan {
  enum class Delay : std::uint8_t { none, constant, uniform, exponential };
  Delay delay = Delay::none;
  double delay_s = 0;            // mean delay of a read; uniform: 0 .. 2 delay_s
  double most_s = 10;            // longest exponential delay
  std::uint64_t fail_every = 0;  // every nth read fails; 0: none
  double fail_probability = 0;   // of each read, 0..1
  std::uint64_t seed = 1;
  std::function<void(double s)> wait = {};  // how to wait; empty: sleeps
};

class FaultySource final : public TileSource {
 public:
  // Passes all reads on until arm(). Throws UsageError if a delay or the probability is out of range.
  FaultySource(std::unique_ptr<TileSource> source, FaultPlan plan);

  void arm();
  void disarm();  // failRange() still applies

  // Reads that touch bytes [begin, end) of the file fail until heal(), armed or not.
  void failRange(const std::string& name, std::uint64_t begin, std::uint64_t end);
  void heal();  // ends all failures for good; delays stay

  std::uint64_t reads() const { return reads_.load(std::memory_order_relaxed); }  // while armed, failed reads included
  std::uint64_t failures() const { return failures_.load(std::memory_order_relaxed); }

  std::uint64_t size(const std::string& name) const override { return source_->size(name); }
  // Throws IoError ("an injected fault") as planned, after the delay.
  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override;
  void expect(const std::string& name, std::uint64_t bytes) const override { source_->expect(name, bytes); }
  bool isRemote() const override { return source_->isRemote(); }
  std::optional<RemoteCounters> remoteCounters() const override { return source_->remoteCounters(); }
  bool discard(const std::string& name, std::uint64_t offset, std::uint64_t bytes) const override {
    return source_->discard(name, offset, bytes);
  }
  std::string describe(const std::string& name) const override { return source_->describe(name); }

 private:
  struct Range {
    std::string name;
    std::uint64_t begin, end;
  };
  std::unique_ptr<TileSource> source_;
  FaultPlan plan_;
  std::atomic<bool> armed_{false};
  mutable std::atomic<std::uint64_t> reads_{0}, failures_{0};
  mutable std::mutex mutex_;
  mutable std::map<std::pair<std::string, std::uint64_t>, std::uint64_t> times_;  // reads by file and offset
  std::vector<Range> ranges_;
  bool healed_ = false;
};

}  // namespace filiform
