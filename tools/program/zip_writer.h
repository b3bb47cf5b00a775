// Zip archives of many small texts, the same bytes for the same texts on every machine. Thread rule: thread-compatible.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace filiform::tools {

struct ZipContent {
  std::size_t entries = 0;
  std::function<std::string(std::size_t)> name;        // UTF-8, different for each entry
  std::function<std::string(std::size_t)> text;        // made when its turn comes; one is held at a time
  std::function<void(std::uint64_t bytes)> written{};  // after each entry, with the length of its text
};

// Writes the archive to `path` and returns its bytes; messages name it `shown`. Passes on what the functions throw, and
// removes what it began. Throws IoError where the archive cannot be written.
std::uint64_t writeZip(const std::string& path, const std::string& shown, const ZipContent& content);

}  // namespace filiform::tools
