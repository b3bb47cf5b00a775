// Zip archives of many small texts. The same texts give the same bytes on every machine. Thread rule:
// thread-compatible.
#pragma once

#include "index/errors.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace filiform::tools {

struct ZipContent {
  std::size_t entries = 0;
  std::function<std::string(std::size_t)> name;  // UTF-8, different for each entry
  std::function<std::string(std::size_t)> text;  // called when the entry is written; one text is held at a time
  // Instead of `text`, for long entries: their bytes, and what gives one part after the other, and at last an empty
  // one.
  std::function<std::uint64_t(std::size_t)> bytes{};
  std::function<std::function<std::string()>(std::size_t)> parts{};
  std::function<void(std::uint64_t bytes)> written{};  // called after each entry with the length of its text
};

// Writes the archive to `path` and returns its size in bytes. Messages name it `shown`. Exceptions from the functions
// propagate. Removes an unfinished archive. Throws IoError if the archive cannot be written.
std::uint64_t writeZip(const std::string& path, const std::string& shown, const ZipContent& content);

}  // namespace filiform::tools
