// MemoryFile: a file in memory, which readers that need a path can open. Nothing of it lies on a disk.
#pragma once

#include "index/internal/descriptor.h"

#include <string>
#include <string_view>

namespace filiform::internal {

// Thread rule: thread-compatible. Throws IoError, with isShortage().
class MemoryFile {
 public:
  // `content`: what the file holds, for messages.
  explicit MemoryFile(std::string content);

  void add(std::string_view bytes) const;  // at the end
  // Opens the file in this or another process of the user, while this object lives.
  std::string path() const;

 private:
  std::string content_;
  Descriptor file_;
};

}  // namespace filiform::internal
