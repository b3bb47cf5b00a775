#include "viewer/window/travel/internal/closing.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

namespace filiform::internal {

namespace {

bool hasEnded(const std::shared_future<std::string>& end) {
  return end.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace

void Closing::begin(std::function<void()> end) {
  std::shared_future<std::string> before;
  if (!ends_.empty()) before = ends_.back();
  ends_.push_back(std::async(std::launch::async, [before = std::move(before), end = std::move(end)]() mutable {
    if (before.valid()) before.wait();
    std::string failure;
    try {
      end();
    } catch (const std::exception& error) {
      failure = error.what();
    }
    end = nullptr;
    return failure;
  }));
}

bool Closing::isUnderWay() const {
  return std::any_of(ends_.begin(), ends_.end(), [](const auto& end) { return !hasEnded(end); });
}

std::vector<std::string> Closing::takeFailures() {
  std::vector<std::string> failures;
  std::erase_if(ends_, [&](std::shared_future<std::string>& end) {
    if (!hasEnded(end)) return false;
    std::string failure = end.get();
    if (!failure.empty()) failures.push_back(std::move(failure));
    return true;
  });
  return failures;
}

std::vector<std::string> Closing::finish() {
  for (const std::shared_future<std::string>& end : ends_) end.wait();
  return takeFailures();
}

}  // namespace filiform::internal
