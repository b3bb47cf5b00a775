#include "tools/python/internal/set_handle.h"

#include "index/errors.h"
#include "index/text.h"

#include <atomic>
#include <pthread.h>
#include <utility>

namespace filiform::python {

namespace {

std::atomic<unsigned> forks{0};  // how often this process is the child of a fork() that it knows of

unsigned countForks() {
  [[maybe_unused]] static const int watched = pthread_atfork(nullptr, nullptr, [] { ++forks; });
  return forks;
}

}  // namespace

SetHandle::SetHandle(std::string name, const std::string& revision, RemoteOptions remote, std::uint64_t budget_bytes)
    : name_(std::move(name)),
      remote_(std::move(remote)),
      budget_bytes_(budget_bytes),
      open_(std::make_shared<const OpenSet>(name_, revision, remote_, budget_bytes_)),
      revision_(open_->set().revision()),
      forks_(countForks()) {}

SetHandle::~SetHandle() { abandonIfForked(); }

void SetHandle::abandonIfForked() noexcept {
  if (forks_ == forks) return;
  // Its destructor would wait for threads that exist only in the parent.
  if (open_) [[maybe_unused]]
    auto* const leaked = new std::shared_ptr<const OpenSet>(std::move(open_));
  open_.reset();
  forks_ = forks;
}

std::shared_ptr<const OpenSet> SetHandle::get() {
  if (closed_) throw UsageError("the set " + inShort(name_) + " is closed; open it again");
  abandonIfForked();
  if (!open_) open_ = std::make_shared<const OpenSet>(name_, revision_, remote_, budget_bytes_);
  return open_;
}

void SetHandle::close() {
  abandonIfForked();
  closed_ = true;
  open_.reset();
}

}  // namespace filiform::python
