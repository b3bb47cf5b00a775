// A file being written: buffered, digested on the way, on the disk when close() returns.
#pragma once

#include "index/internal/bytes.h"

#include <memory>
#include <string>

namespace filiform::internal {

// XXH3 of bytes that come piece by piece. Thread-compatible.
class RunningDigest {
 public:
  RunningDigest();
  RunningDigest(const RunningDigest&) = delete;
  RunningDigest& operator=(const RunningDigest&) = delete;
  ~RunningDigest();
  void add(ByteSpan bytes);
  std::uint64_t value() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Thread-compatible. Throws IoError with the system's reason, a full disk included.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);  // must not exist
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();  // closes without a word; what was not close()d is not promised

  void write(ByteSpan bytes);
  void close();  // flushes to the disk
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t digest() const { return digest_.value(); }  // of everything written so far

 private:
  void flush();
  std::string path_;
  int file_;
  std::uint64_t bytes_ = 0;
  Bytes buffer_;
  RunningDigest digest_;
};

// Makes the names in a folder survive a crash. Throws IoError.
void syncFolder(const std::string& path);

}  // namespace filiform::internal
