// A time limit for ending the program. A thread may hang in a read that never returns; joining it would hang too.
//
//   EndingWatch watch(5, [] { /* print a message and end the process */ })
//   options.ending = [&watch] { watch.begin(); };  // called before the threads are joined
//   run(*store, options)
//
// Thread rule: one owner; `stuck` is called on a thread of the watch.
#pragma once

#include <functional>
#include <memory>

namespace filiform::tools {

class EndingWatch {
 public:
  EndingWatch(double patience_s, std::function<void()> stuck);
  ~EndingWatch();  // stops the watch: `stuck` is not called later. If it is running, the destructor waits for it
  EndingWatch(const EndingWatch&) = delete;
  EndingWatch& operator=(const EndingWatch&) = delete;

  // Starts the time limit; later calls do nothing. If the system cannot start a thread, there is no time limit.
  void begin() noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Allows three seconds. Then: one line on stderr, zero force, exit code 3.
EndingWatch watchForSilentFiles();

}  // namespace filiform::tools
