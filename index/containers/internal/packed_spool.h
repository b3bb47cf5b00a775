// Content of a compressed archive, kept in an unnamed file so that its entries can be read in any order. Blocks are
// packed by LZ4: a hostile archive makes a file of a few times its own size at most, where gzip alone would let it make
// a thousand times as much. Thread rule: add() by one thread; then read() by any.
#pragma once

#include "index/containers/internal/container.h"
#include "index/file/internal/unnamed_file.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

class PackedSpool {
 public:
  // Begins an entry and returns its place. Throws IoError, as add() and end().
  std::uint64_t begin();
  void add(std::string_view bytes);
  void end();

  // Passes the entry at `place`, of `bytes` bytes, to `sink` in blocks.
  void read(std::uint64_t place, std::uint64_t bytes, const Container::Reader::Sink& sink) const;

 private:
  void writeBlock();

  UnnamedFile file_{"", "the archive's content"};
  std::uint64_t end_ = 0;
  std::string block_;
};

}  // namespace filiform::internal
