// Reads a file of input, in whole or in parts. Thread rule: thread-compatible.
#pragma once

#include "index/internal/descriptor.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

namespace filiform::internal {

class FileParts {
 public:
  // Opens the file. Throws IoError.
  explicit FileParts(std::string path);
  // The same for a file that must still have `bytes` bytes.
  FileParts(std::string path, std::uint64_t bytes);

  std::uint64_t size() const;
  // Fills all of `bytes` from `offset` on. Throws IoError.
  void read(std::uint64_t offset, std::span<char> bytes) const;
  // The next bytes, also of a pipe. Returns their number, below bytes.size() only at the end. Throws IoError.
  std::size_t next(std::span<char> bytes);
  // Passes `bytes` bytes from `offset` on to `sink`, in blocks.
  void pass(std::uint64_t offset, std::uint64_t bytes, const std::function<void(std::string_view)>& sink) const;

 private:
  std::string path_;
  Descriptor file_;
};

}  // namespace filiform::internal
