#include "index/file/internal/memory_file.h"

#include "index/errors.h"

#include <cerrno>
#include <sys/mman.h>
#include <unistd.h>
#include <utility>

namespace filiform::internal {

MemoryFile::MemoryFile(std::string content)
    : content_(std::move(content)), file_(::memfd_create("filiform", MFD_CLOEXEC)) {
  if (!file_.isOpen()) throw IoError("memory", "cannot hold " + content_, errno).asShortage();
}

void MemoryFile::add(std::string_view bytes) const {
  if (!file_.write(bytes.data(), bytes.size())) throw IoError("memory", "cannot hold " + content_, errno).asShortage();
}

std::string MemoryFile::path() const {
  return "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(file_.number());
}

}  // namespace filiform::internal
