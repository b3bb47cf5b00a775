// Runs work that ends a scene or device, and may wait for the disk or the device, beside the frames.
//
//   closing.begin([travel = std::move(travel)]() mutable {
//     travel->finish();
//     travel.reset();  // here, not on the thread that draws
//   });
//
// Thread rule: one owner. Work given to begin() runs on another thread.
#pragma once

#include <functional>
#include <future>
#include <string>
#include <vector>

namespace filiform::internal {

class Closing {
 public:
  // Starts the work after all earlier work has ended. The destructor waits for all.
  void begin(std::function<void()> end);
  bool isUnderWay() const;
  // Returns what the work that ended since the last call has thrown, one line each.
  std::vector<std::string> takeFailures();
  // Waits for all work, then does takeFailures().
  std::vector<std::string> finish();

 private:
  std::vector<std::shared_future<std::string>> ends_;  // each gives the reason of its failure, or an empty text
};

}  // namespace filiform::internal
