#include "tests/fuzz/fuzz_bytes.h"

#include <sys/mman.h>
#include <unistd.h>

namespace filiform::fuzz {

MemoryFile::MemoryFile() : file_(::memfd_create("fuzz", MFD_CLOEXEC)) {
  require(file_ >= 0, "the system gives a file in memory");
  path_ = "/proc/self/fd/" + std::to_string(file_);
}

MemoryFile::~MemoryFile() { ::close(file_); }

void MemoryFile::hold(Input content) {
  const bool held = ::ftruncate(file_, 0) == 0 &&
                    ::pwrite(file_, content.data(), content.size(), 0) == static_cast<ssize_t>(content.size());
  require(held, "the system keeps what is written");
}

}  // namespace filiform::fuzz
