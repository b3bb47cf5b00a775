#include "index/input/internal/file_parts.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <memory>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace filiform::internal {
namespace {

constexpr const char* kFileChanged = "changed while it was being read; run again";

}  // namespace

FileParts::FileParts(std::string path, std::uint64_t bytes)
    : path_(std::move(path)), fd_(::open(path_.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (fd_ < 0) throw IoError(escaped(path_), "cannot open", errno);
  struct stat status {};
  const bool known = ::fstat(fd_, &status) == 0;
  const int error = errno;
  if (known && static_cast<std::uint64_t>(status.st_size) == bytes) return;
  ::close(fd_);
  if (!known) throw IoError(escaped(path_), "cannot read", error);
  throw IoError(escaped(path_), kFileChanged);
}

FileParts::~FileParts() { ::close(fd_); }

void FileParts::read(std::uint64_t offset, std::span<char> bytes) const {
  while (!bytes.empty()) {
    const ssize_t got = ::pread(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw IoError(escaped(path_), "cannot read", errno);
    if (got == 0) throw IoError(escaped(path_), kFileChanged);
    bytes = bytes.subspan(static_cast<std::size_t>(got));
    offset += static_cast<std::uint64_t>(got);
  }
}

void FileParts::pass(std::uint64_t offset, std::uint64_t bytes, const Container::Reader::Sink& sink) const {
  constexpr std::uint64_t kBlock = 1 << 16;
  const std::unique_ptr<char[]> block(new char[kBlock]);
  while (bytes > 0) {
    const std::size_t some = static_cast<std::size_t>(std::min(bytes, kBlock));
    read(offset, {block.get(), some});
    sink({block.get(), some});
    offset += some;
    bytes -= some;
  }
}

}  // namespace filiform::internal
