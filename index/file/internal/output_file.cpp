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
  if (!file_.isOpen()) throw IoError(path, "cannot be created", errno);
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
  if (!file_.write(buffer_.data(), buffer_.size())) throw IoError(path_, "cannot be written", errno);
  buffer_.clear();
}

void OutputFile::close() {
  flush();
  if (::fsync(file_.number()) != 0 || !file_.close()) throw IoError(path_, "cannot be written", errno);
}

void syncFolder(const std::string& path) {
  const Descriptor folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder.isOpen()) throw IoError(path, "cannot be opened", errno);
  if (::fsync(folder.number()) != 0 && errno != EINVAL)
    throw IoError(path, "cannot be written", errno);  // EINVAL: this file system does not support it
}

}  // namespace filiform::internal
