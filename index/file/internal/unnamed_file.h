// UnnamedFile: a working file that loses its name as soon as it is open. So nothing remains, however the program ends.
#pragma once

#include "index/internal/descriptor.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

namespace filiform::internal {

std::string temporaryFolder();  // $TMPDIR, or /tmp

// Thread rule: thread-compatible; any number of threads may call read() and write(). Throws IoError, with isShortage().
class UnnamedFile {
 public:
  // `folder`: empty for temporaryFolder(). `content`: what the file holds, for messages.
  UnnamedFile(std::string folder, std::string content)
      : folder_(folder.empty() ? temporaryFolder() : std::move(folder)), content_(std::move(content)) {}

  void create();  // call it before the others; later calls do nothing
  void write(std::uint64_t at, const void* from, std::size_t bytes) const;
  void read(std::uint64_t at, void* to, std::size_t bytes) const;
  [[noreturn]] void failReading(int error_number) const { fail("cannot read ", error_number); }

 private:
  [[noreturn]] void fail(const char* what, int error_number) const;
  std::string folder_, content_;
  Descriptor file_;
};

}  // namespace filiform::internal
