// ColumnSpool: columns of bytes that grow side by side: the last 64 KiB of each in memory, the rest in one unnamed file
// in $TMPDIR or /tmp. Thread rule: thread-compatible.
#pragma once

#include "index/errors.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace filiform::tools {

class ColumnSpool {
 public:
  // `content`: what the file holds, for messages.
  ColumnSpool(std::size_t columns, const std::string& content);
  ~ColumnSpool();
  ColumnSpool(ColumnSpool&&) noexcept;

  // Throws IoError.
  void append(std::size_t column, const void* bytes, std::size_t count);
  // Of a column, the part from 64 KiB * `index` on; empty behind its end. Throws IoError.
  std::string part(std::size_t column, std::size_t index) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::tools
