// SetHandle: what a filiform.Set of Python holds: a name, a revision, and the open set behind them.
//
// A process that was forked opens the same revision again at its first call: locks and threads of its parent are not
// its own, so it neither uses nor destroys what the parent opened. Thread rule: hold Python's global lock for every
// member.
#pragma once

#include "tools/python/internal/open_set.h"

#include <cstdint>
#include <memory>
#include <string>

namespace filiform::python {

class SetHandle {
 public:
  // Opens the set; `revision` is empty for the newest. Throws as OpenSet.
  SetHandle(std::string name, const std::string& revision, RemoteOptions remote, std::uint64_t budget_bytes);
  ~SetHandle();
  SetHandle(const SetHandle&) = delete;
  SetHandle& operator=(const SetHandle&) = delete;

  // The open set, for one call; it stays valid if close() comes meanwhile. Throws UsageError after close(), and what
  // opening throws in a forked process.
  std::shared_ptr<const OpenSet> get();
  // Closes files once the calls under way have ended. A second call has no effect.
  void close();
  bool closed() const { return closed_; }
  const std::string& name() const { return name_; }          // folder or address
  const std::string& revision() const { return revision_; }  // the same while this object lives

 private:
  void abandonIfForked() noexcept;

  const std::string name_;
  const RemoteOptions remote_;
  const std::uint64_t budget_bytes_;
  std::shared_ptr<const OpenSet> open_;
  const std::string revision_;
  unsigned forks_;  // of this process when open_ was opened
  bool closed_ = false;
};

}  // namespace filiform::python
