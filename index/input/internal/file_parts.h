// Reads parts of a file that must not change meanwhile. Thread rule: thread-compatible.
#pragma once

#include "index/input/internal/container.h"

#include <cstdint>
#include <span>
#include <string>

namespace filiform::internal {

class FileParts {
 public:
  // Opens the file. Throws IoError, also if it does not have `bytes` bytes.
  FileParts(std::string path, std::uint64_t bytes);
  ~FileParts();
  FileParts(const FileParts&) = delete;
  FileParts& operator=(const FileParts&) = delete;

  // Fills all of `bytes` from `offset` on. Throws IoError.
  void read(std::uint64_t offset, std::span<char> bytes) const;
  // Passes `bytes` bytes from `offset` on to `sink`, in blocks.
  void pass(std::uint64_t offset, std::uint64_t bytes, const Container::Reader::Sink& sink) const;
  int descriptor() const { return fd_; }

 private:
  std::string path_;
  int fd_ = -1;
};

}  // namespace filiform::internal
