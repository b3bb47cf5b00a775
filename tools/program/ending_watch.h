// An end that does not wait for ever: where a thread hangs in a read that never returns, nothing in the program can end
// it, and joining it would hang too.
//
//   EndingWatch watch(5, [] { /* say so, and end the process */ });
//   options.ending = [&watch] { watch.begin(); };  // before it joins its threads
//   run(*store, options);
//
// Thread rule: one owner; `stuck` is called on a thread of the watch's own.
#pragma once

#include <functional>
#include <memory>

namespace filiform::tools {

class EndingWatch {
 public:
  EndingWatch(double patience_s, std::function<void()> stuck);
  ~EndingWatch();  // in time: `stuck` is not called any more, and is waited for if it runs
  EndingWatch(const EndingWatch&) = delete;
  EndingWatch& operator=(const EndingWatch&) = delete;

  // The patience runs from here; idempotent. Where the system gives no thread for it, the end waits as it would
  // without.
  void begin() noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// After three seconds: one line, zero force, exit code 3.
EndingWatch watchForSilentFiles();

}  // namespace filiform::tools
