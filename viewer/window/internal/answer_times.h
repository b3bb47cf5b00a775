// AnswerTimes: how long a person waits from a key or the mouse to the frame that shows what it changed. Thread rule:
// thread-compatible.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

namespace filiform::internal {

class AnswerTimes {
 public:
  // Events, if there are some, came while the window was polled from begin_s to end_s. Those that end a wait of more
  // than `wait_s` come at its end; others came in the frame before, after its poll at the earliest.
  void poll(double begin_s, double end_s, bool has_events, double wait_s) {
    if (has_events && asked_s_ < 0 && has_presented_) {
      asked_s_ = end_s - begin_s > wait_s ? end_s : polled_s_;
      asked_frame_ = frame_;
    }
    polled_s_ = end_s;
  }
  // A frame is on the screen.
  void presented(double now_s) {
    has_presented_ = true;
    if (asked_s_ >= 0) longest_ms_ = std::max(longest_ms_, 1000 * (now_s - std::exchange(asked_s_, -1)));
  }
  // Events that no frame has shown by now change nothing that is shown.
  void endFrame() {
    if (frame_ > asked_frame_ + kAnswered_frames) asked_s_ = -1;
    ++frame_;
  }
  double longest_ms() const { return longest_ms_; }

 private:
  // The haptic loop takes commands between frames.
  static constexpr std::uint64_t kAnswered_frames = 4;

  double polled_s_ = 0, asked_s_ = -1;  // asked_s_: the earliest time of events that no frame shows yet; -1: none
  double longest_ms_ = 0;
  std::uint64_t frame_ = 0, asked_frame_ = 0;
  bool has_presented_ = false;
};

}  // namespace filiform::internal
