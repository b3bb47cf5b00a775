#include "index/file/internal/record_store.h"

#include "index/errors.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fcntl.h>
#include <string>
#include <unistd.h>

namespace filiform::internal {
namespace {

std::string temporaryFolder() {
  const char* const folder = std::getenv("TMPDIR");
  return folder != nullptr && *folder != '\0' ? folder : "/tmp";
}

// A failure of the process, not of the input being read.
IoError failure(const char* what, int error_number) {
  return IoError(temporaryFolder(), std::string(what) + " (the folder of temporary files: TMPDIR names another)",
                 error_number)
      .asShortage();
}

constexpr const char* kCannotHold = "cannot hold the list of dropped lines";

}  // namespace

std::shared_ptr<RecordStore> RecordStore::shared() {
  static std::mutex mutex;
  static std::weak_ptr<RecordStore> known;
  const std::lock_guard lock(mutex);
  std::shared_ptr<RecordStore> store = known.lock();
  if (!store) known = store = std::make_shared<RecordStore>();
  return store;
}

RecordStore::~RecordStore() {
  if (file_ >= 0) ::close(file_);
}

std::uint64_t RecordStore::append(std::span<const std::uint8_t> bytes) {
  const std::lock_guard lock(mutex_);
  const std::uint64_t begin = end_;
  if (end_ < kInMemory) {
    const std::size_t n = std::min<std::size_t>(bytes.size(), kInMemory - end_);
    memory_.insert(memory_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n));
    end_ += n;
    bytes = bytes.subspan(n);
  }
  if (!bytes.empty() && file_ < 0) {
    std::string path = temporaryFolder() + "/filiform-records-XXXXXX";
    file_ = ::mkostemp(path.data(), O_CLOEXEC);
    if (file_ < 0) throw failure(kCannotHold, errno);
    ::unlink(path.c_str());
  }
  while (!bytes.empty()) {
    const ssize_t n = ::pwrite(file_, bytes.data(), bytes.size(), static_cast<off_t>(end_ - kInMemory));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw failure(kCannotHold, n < 0 ? errno : ENOSPC);
    end_ += static_cast<std::uint64_t>(n);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return begin;
}

void RecordStore::read(std::uint64_t at, std::span<std::uint8_t> bytes) const {
  const std::lock_guard lock(mutex_);
  if (at < kInMemory) {
    const std::size_t n = std::min<std::size_t>(bytes.size(), kInMemory - at);
    std::copy_n(memory_.begin() + static_cast<std::ptrdiff_t>(at), n, bytes.begin());
    bytes = bytes.subspan(n);
    at += n;
  }
  while (!bytes.empty()) {
    const ssize_t n = ::pread(file_, bytes.data(), bytes.size(), static_cast<off_t>(at - kInMemory));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw failure("cannot read the list of dropped lines", n < 0 ? errno : EIO);
    at += static_cast<std::uint64_t>(n);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
}

}  // namespace filiform::internal
