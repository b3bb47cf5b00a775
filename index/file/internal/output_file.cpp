#include "index/file/internal/output_file.h"

#include "index/errors.h"

#include <cerrno>
#include <fcntl.h>
#include <unistd.h>

namespace filiform::internal {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;

}  // namespace

OutputFile::OutputFile(const std::string& path)
    : path_(path), file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)) {
  if (file_ < 0) throw IoError(path, "cannot be created", errno);
}

OutputFile::~OutputFile() {
  if (file_ >= 0) ::close(file_);
}

void OutputFile::write(ByteSpan bytes) {
  digest_.add(bytes);
  bytes_ += bytes.size();
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  if (buffer_.size() >= kBufferBytes) flush();
}

void OutputFile::write(std::string_view text) {
  write(ByteSpan(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

void OutputFile::flush() {
  for (std::size_t done = 0; done < buffer_.size();) {
    const ssize_t n = ::write(file_, buffer_.data() + done, buffer_.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw IoError(path_, "cannot be written", errno);
    done += static_cast<std::size_t>(n);
  }
  buffer_.clear();
}

void OutputFile::close() {
  flush();
  if (::fsync(file_) != 0) throw IoError(path_, "cannot be written", errno);
  const int file = file_;
  file_ = -1;
  if (::close(file) != 0) throw IoError(path_, "cannot be written", errno);
}

void syncFolder(const std::string& path) {
  const int folder = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) throw IoError(path, "cannot be opened", errno);
  const int failed = ::fsync(folder) != 0 ? errno : 0;
  ::close(folder);
  if (failed != 0 && failed != EINVAL)
    throw IoError(path, "cannot be written", failed);  // EINVAL: this file system does not support it
}

}  // namespace filiform::internal
