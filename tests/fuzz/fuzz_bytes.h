// Shared by the fuzz targets: numbers from the input, and a file with its bytes for readers that need a path.
#pragma once

#include "tests/fuzz/fuzzers.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>

namespace filiform::fuzz {

inline std::string_view asText(Input input) { return {reinterpret_cast<const char*>(input.data()), input.size()}; }

// Takes values from the front; zeros after the end of the input.
class Taker {
 public:
  explicit Taker(Input input) : rest_(input) {}
  template <class Number>
  Number number() {
    Number value{};
    const Input bytes = some(sizeof value);
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), bytes.size());
    return value;
  }
  Input some(std::size_t most) {
    const Input taken = rest_.first(std::min(most, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  Input rest() const { return rest_; }
  bool empty() const { return rest_.empty(); }

 private:
  Input rest_;
};

// A file in memory that has a path. Its content changes; the path does not.
class MemoryFile {
 public:
  MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile();
  void hold(Input content);
  const std::string& path() const { return path_; }

 private:
  int file_;
  std::string path_;
};

}  // namespace filiform::fuzz
