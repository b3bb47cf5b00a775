// Work that may read the disk, done beside the frames: one thread, in the order asked.
//
//   Worker worker;
//   worker.ask([&] { return [&go, place = nearest.find(p_W)] { go(place); }; });
//   worker.serve(showError);  // once a frame: runs what the finished works returned
//
// Thread rule: one owner, to which all members belong; the works run on the worker's thread, what they return on the
// owner's.
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
  // Waits for the work under way; leaves out what has not begun, and all that was to be served.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void ask(Work work);
  // What a work threw is told to `failed`, one line each.
  void serve(const std::function<void(const std::string&)>& failed);
  bool idle() const;  // nothing asked that has not been served

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
