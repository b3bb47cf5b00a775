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
#include <string>

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

// Allows `patience_s`. Then: zero force; `close`, which finishes what the command has to write and returns why it ends,
// empty if only the files or the device hang; one line on stderr; exit code 3. Begin it when no other thread writes.
EndingWatch watchForSilentFiles(std::function<std::string()> close = {}, double patience_s = 3);

}  // namespace filiform::tools
