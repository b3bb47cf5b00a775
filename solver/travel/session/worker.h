// A thread for work that may read the disk, so that drawing does not wait. Works run one after another, in the order of
// ask().
//
//   Worker worker;
//   worker.ask([&] { return [&go, place = nearest.find(p_W)] { go(place); }; });
//   worker.serve(showError);  // once a frame: runs what the finished works returned
//
// Thread rule: all members belong to one owner. Works run on the worker's thread; the functions that they return run on
// the owner's thread.
#pragma once

#include <functional>
#include <memory>
#include <string>

namespace filiform {

class Worker {
 public:
  using Done = std::function<void()>;  // may be empty
  using Work = std::function<Done()>;

  Worker();
  // Waits for the running work. Drops works that have not begun, and results that were not served.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void ask(Work work);
  // Runs the functions that finished works returned. Passes the exceptions of works to `failed`, one line each.
  void serve(const std::function<void(const std::string&)>& failed);
  bool idle() const;  // all works have been served

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
