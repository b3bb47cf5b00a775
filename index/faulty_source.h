// A source of bytes that is slow or fails on demand: for tests, and to try a set as if it lay on a far or worn-out
// disk.
//
//   auto source = std::make_unique<FaultySource>(openFolder(path), FaultPlan{.delay = FaultPlan::Delay::constant,
//                                                                           .delay_s = 0.02});
//   FaultySource& faults = *source;
//   const auto set = TileSet::open(std::move(source));
//   faults.arm();  // from now on
//
// What befalls a read is a function of the seed, the place read and how often it was read before, not of threads or the
// clock; only `fail_every` counts reads in the order in which they come. Thread rule: internally synchronised.
#pragma once

#include "index/tile_source.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <vector>

namespace filiform {

struct FaultPlan {
  enum class Delay : std::uint8_t { none, constant, uniform, exponential };
  Delay delay = Delay::none;
  double delay_s = 0;            // mean of the delay of a read; uniform: 0 .. 2 delay_s
  double most_s = 10;            // an exponential tail is cut here
  std::uint64_t fail_every = 0;  // every nth read fails; 0: none
  double fail_probability = 0;   // of each read, 0..1
  std::uint64_t seed = 1;
  std::function<void(double s)> wait = {};  // empty: sleeps
};

class FaultySource final : public TileSource {
 public:
  // Lets everything pass until arm(). Throws UsageError for a plan with a delay or probability out of range.
  FaultySource(std::unique_ptr<TileSource> source, FaultPlan plan);

  void arm();
  void disarm();  // ranges fail all the same

  // Reads that touch bytes [begin, end) of the file fail until healed.
  void failRange(const std::string& name, std::uint64_t begin, std::uint64_t end);
  void heal();  // all ranges, and nothing fails by plan any more; delays stay

  std::uint64_t reads() const { return reads_.load(std::memory_order_relaxed); }  // while armed, failed ones included
  std::uint64_t failures() const { return failures_.load(std::memory_order_relaxed); }

  std::uint64_t size(const std::string& name) const override { return source_->size(name); }
  // Throws IoError ("an injected fault") as planned, after the delay.
  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override;
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
  mutable std::map<std::pair<std::string, std::uint64_t>, std::uint64_t> times_;  // each place was read
  std::vector<Range> ranges_;
  bool healed_ = false;
};

}  // namespace filiform
