// Ends what may wait for a disk or a device when it ends, beside the frames.
//
//   closing.begin([travel = std::move(travel)]() mutable {
//     travel->finish();
//     travel.reset();  // here, not where the frames are drawn
//   });
//
// Thread rule: one owner; what is given to begin() runs on a thread of its own.
#pragma once

#include <functional>
#include <future>
#include <string>
#include <vector>

namespace filiform::internal {

class Closing {
 public:
  // One after the other, in this order. The destructor waits for all.
  void begin(std::function<void()> end);
  bool isUnderWay() const;
  // Of what has ended since the last call: what was thrown, one line each.
  std::vector<std::string> takeFailures();
  // Waits for all; then the same.
  std::vector<std::string> finish();

 private:
  std::vector<std::shared_future<std::string>> ends_;  // each gives why it failed, or nothing
};

}  // namespace filiform::internal
