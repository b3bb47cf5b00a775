// The messages that the window shows: the newest lines, each for some seconds. Thread rule: one owner.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <utility>
#include <vector>

namespace filiform::internal {

class Messages {
 public:
  static constexpr double kShown_s = 6;
  static constexpr std::size_t kMost = 5;

  void setTime(double now_s) { now_s_ = now_s; }
  void say(const std::string& text) {
    kept_.emplace_back(now_s_, text);
    if (kept_.size() > kMost) kept_.pop_front();
    last_ = text;
    ++count_;
  }
  // Says a text that differs from the last one.
  void sayOnce(const std::string& text) {
    if (text != last_) say(text);
  }

  std::vector<std::string> shown() const {  // newest last
    std::vector<std::string> lines;
    for (const auto& [since_s, text] : kept_)
      if (now_s_ - since_s < kShown_s) lines.push_back(text);
    return lines;
  }
  const std::string& last() const { return last_; }
  std::uint64_t count() const { return count_; }

 private:
  double now_s_ = 0;
  std::deque<std::pair<double, std::string>> kept_;
  std::string last_;
  std::uint64_t count_ = 0;
};

}  // namespace filiform::internal
