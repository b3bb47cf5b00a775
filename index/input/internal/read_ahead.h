// ReadAhead: reads inputs on several threads and hands them on in order.
//
// The calling thread reads too while it waits. Large inputs are not read ahead. Thread rule: one thread calls all
// members; Plan::read is called on all threads.
#pragma once

#include "index/cell/cell.h"
#include "index/reports/input_report.h"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace filiform::internal {

class ReadAhead {
 public:
  // An input that was read, or the exception that ended its reading.
  struct Result {
    InputReport report;
    Cell cell;
    std::uint64_t bytes = 0;  // read on disk
    std::exception_ptr failure;
  };

  static constexpr std::uint64_t kSkip = UINT64_MAX - 1;  // the input is left out
  static constexpr std::uint64_t kAlone = UINT64_MAX;     // the caller reads it itself, without take()

  struct Plan {
    unsigned threads = 1;     // that read, the calling one included
    std::uint64_t bytes = 0;  // most memory of the inputs under way
    // For each input: the memory that it takes at most, bytes; or kSkip, or kAlone.
    std::vector<std::uint64_t> costs;
    // Reads an input. `reader` is below `threads`; 0 is the calling thread. While `stop` is true, it may throw.
    std::function<void(unsigned reader, std::size_t item, const std::atomic<bool>& stop, Result& result)> read;
  };

  explicit ReadAhead(Plan plan);
  // Stops the readers, within one block of input each.
  ~ReadAhead();
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  // False for kSkip and kAlone.
  bool isAhead(std::size_t item) const { return plan_.costs[item] < kSkip; }
  // Returns input `item` in `result`, and reads on behind it. The cell of `result` is exchanged, to reuse its memory.
  // Calls `wait` every 0.1 s while it waits; its exceptions propagate. If the calls do not ascend, starts anew at
  // `item`. Requires isAhead(item).
  void take(std::size_t item, Result& result, const std::function<void()>& wait);

 private:
  struct Slot {
    std::size_t item = 0;
    std::uint64_t bytes = 0;
    bool done = false;
    Result result;
  };

  void work(unsigned reader);
  bool mayRead();
  void readNext(unsigned reader, std::unique_lock<std::mutex>& lock);
  void startThreads();
  void discard(std::unique_lock<std::mutex>& lock);
  void recycle(std::unique_ptr<Slot> slot);

  const Plan plan_;
  std::mutex mutex_;
  std::condition_variable room_, done_;
  std::deque<std::unique_ptr<Slot>> slots_;  // consecutive inputs, the first to be taken next
  std::vector<std::unique_ptr<Slot>> spare_;
  std::size_t next_ = 0;  // to be read next
  std::uint64_t used_ = 0;
  unsigned busy_ = 0;
  bool paused_ = true, ended_ = false;
  std::atomic<bool> stop_{false};
  std::vector<std::jthread> threads_;
};

}  // namespace filiform::internal
