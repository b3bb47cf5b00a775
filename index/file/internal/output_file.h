// A file being written: buffered, with a digest, flushed to disk by close().
#pragma once

#include "index/file/internal/bytes.h"
#include "index/file/internal/digest.h"
#include "index/internal/descriptor.h"

#include <string>
#include <string_view>

namespace filiform::internal {

// Thread rule: thread-compatible. Throws IoError with the system's reason, also for a full disk.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);  // must not exist

  void write(ByteSpan bytes);
  void write(std::string_view text);
  void close();  // flushes to disk; without it the content is not guaranteed
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t digest() const { return digest_.value(); }  // of everything written so far

 private:
  void flush();
  std::string path_;
  Descriptor file_;
  std::uint64_t bytes_ = 0;
  Bytes buffer_;
  RunningDigest digest_;
};

// Makes the names in a folder survive a crash. Throws IoError.
void syncFolder(const std::string& path);

}  // namespace filiform::internal
