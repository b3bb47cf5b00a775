// ReadThreads: threads that stay, for file/future_read.h. In a browser a thread costs some 4 MB, and the memory of one
// that has ended is not given back. Thread rule: internally synchronised.
#pragma once

#include <functional>
#include <memory>

namespace filiform {

class ReadThreads {
 public:
  explicit ReadThreads(unsigned most);
  ~ReadThreads();  // waits for the works that run; drops the others
  ReadThreads(const ReadThreads&) = delete;
  ReadThreads& operator=(const ReadThreads&) = delete;

  // Runs `work`, which does not throw, on a thread of its own as soon as one is free. A new thread begins where none is
  // free, with the priority of the caller. If the system grants none, `work` may wait for ever.
  void add(std::function<void()> work);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
