#include "index/file/internal/unnamed_file.h"

#include "index/errors.h"

#include <cstdlib>
#include <fcntl.h>

namespace filiform::internal {

std::string temporaryFolder() {
  const char* const folder = std::getenv("TMPDIR");
  return folder != nullptr && *folder != '\0' ? folder : "/tmp";
}

void UnnamedFile::fail(const char* what, int error_number) const {
  const bool is_temporary = folder_ == temporaryFolder();
  throw IoError(folder_,
                what + content_ + (is_temporary ? " (the folder of temporary files: TMPDIR names another)" : ""),
                error_number)
      .asShortage();
}

void UnnamedFile::create() {
  if (file_.isOpen()) return;
  std::string path = folder_ + "/filiform-XXXXXX";
  file_ = Descriptor(::mkostemp(path.data(), O_CLOEXEC));
  if (!file_.isOpen()) fail("cannot hold ", errno);
  ::unlink(path.c_str());
}

void UnnamedFile::write(std::uint64_t at, const void* from, std::size_t bytes) const {
  if (!file_.writeAt(at, from, bytes)) fail("cannot hold ", errno);
}

void UnnamedFile::read(std::uint64_t at, void* to, std::size_t bytes) const {
  if (file_.readAt(at, to, bytes) != bytes) failReading(errno);
}

}  // namespace filiform::internal
