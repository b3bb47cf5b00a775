// BackgroundReads: while it lives, reads of this thread over HTTP are bulk work, or with `false` are not. Bulk work
// uses part of the connections only, so that reads for a moving hand never wait behind it. Thread rule: belongs to the
// thread that makes it.
#pragma once

namespace filiform::internal {

class BackgroundReads {
 public:
  explicit BackgroundReads(bool active = true) : before_(active_) { active_ = active; }
  ~BackgroundReads() { active_ = before_; }
  BackgroundReads(const BackgroundReads&) = delete;
  BackgroundReads& operator=(const BackgroundReads&) = delete;

  static bool active() { return active_; }  // on the calling thread

 private:
  inline static thread_local bool active_ = false;
  bool before_;
};

}  // namespace filiform::internal
