// An end that does not wait for ever: where a thread hangs in a read that never returns, nothing in the program can end
// it, and joining it would hang too.
//
//   EndingWatch watch(5, [] { /* say so, and end the process */ });
//   { Application application; application.run(); watch.begin(); }  // ends its threads, as a rule at once
//
// Thread rule: one owner; `stuck` is called on a thread of the watch's own.
#pragma once

#include <functional>
#include <memory>

namespace filiform::internal {

class EndingWatch {
 public:
  EndingWatch(double patience_s, std::function<void()> stuck);
  ~EndingWatch();  // in time: `stuck` is not called any more, and is waited for if it runs
  EndingWatch(const EndingWatch&) = delete;
  EndingWatch& operator=(const EndingWatch&) = delete;

  void begin();  // the patience runs from here; idempotent

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::internal
