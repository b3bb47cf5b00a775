#include "index/file/internal/file_parts.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <memory>
#include <optional>
#include <sys/stat.h>
#include <utility>

namespace filiform::internal {
namespace {

constexpr const char* kFileChanged = "changed while it was being read; run again";

}  // namespace

FileParts::FileParts(std::string path) : path_(std::move(path)), file_(::open(path_.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (!file_.isOpen()) throw IoError(inShort(path_), "cannot open", errno);
}

FileParts::FileParts(std::string path, std::uint64_t bytes) : FileParts(std::move(path)) {
  if (size() != bytes) throw IoError(inShort(path_), kFileChanged);
}

std::uint64_t FileParts::size() const {
  struct stat status {};
  if (::fstat(file_.number(), &status) != 0) throw IoError(inShort(path_), "cannot read", errno);
  return static_cast<std::uint64_t>(status.st_size);
}

void FileParts::read(std::uint64_t offset, std::span<char> bytes) const {
  const std::optional<std::size_t> n = file_.readAt(offset, bytes.data(), bytes.size());
  if (!n) throw IoError(inShort(path_), "cannot read", errno);
  if (*n < bytes.size()) throw IoError(inShort(path_), kFileChanged);
}

std::size_t FileParts::next(std::span<char> bytes) {
  const std::optional<std::size_t> n = file_.read(bytes.data(), bytes.size());
  if (!n) throw IoError(inShort(path_), "cannot read", errno);
  return *n;
}

void FileParts::pass(std::uint64_t offset, std::uint64_t bytes,
                     const std::function<void(std::string_view)>& sink) const {
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
