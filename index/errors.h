// Errors that the program reports, one class a cause. Each text names the file, line, tile or option, and what to do.
// The haptic tick never throws: it returns values. Thread rule: values.
#pragma once

#include "index/error.h"

#include <cstdint>
#include <string>

namespace filiform {

// Input that cannot be used, or a refusal: nothing to ingest, not a zip, an existing set without --force. Exit code 1.
class InputError : public Error {
 public:
  using Error::Error;
};

// A tile set whose bytes differ from those written: bad checksum, short file, impossible count. Exit code 1.
class CorruptSet : public Error {
 public:
  // `offset`: position of the damage in `file`, bytes.
  CorruptSet(const std::string& file, std::uint64_t offset, const std::string& what);
  const std::string& file() const { return file_; }
  std::uint64_t offset() const { return offset_; }

 private:
  std::string file_;
  std::uint64_t offset_;
};

// Damage in one tile; `offset` is the position in its pack file.
class CorruptTile : public CorruptSet {
 public:
  CorruptTile(std::uint32_t tile, const std::string& file, std::uint64_t offset, const std::string& what);
  std::uint32_t tile() const { return tile_; }

 private:
  std::uint32_t tile_;
};

// A failed call of the operating system: missing or unreadable file, disk full, read or write error. Exit code 3.
class IoError : public Error {
 public:
  IoError(const std::string& file, const std::string& what);
  // Appends the text of `error_number` (an errno value).
  IoError(const std::string& file, const std::string& what, int error_number);
  const std::string& reason() const { return reason_; }  // what() without the file
  // True if the process lacks a file descriptor, memory or room for temporary files. The input is then not at fault.
  bool isShortage() const { return shortage_; }
  IoError& asShortage() {
    shortage_ = true;
    return *this;
  }

 private:
  std::string reason_;
  bool shortage_ = false;
};

// The reader of a pipe closed it, as `head` does after enough lines. Exit code 141 without a message, as after SIGPIPE.
class ClosedPipe : public Error {
 public:
  using Error::Error;
};

// The work was told to stop, usually by a signal. Exit code 128 + signal.
class Interrupted : public Error {
 public:
  using Error::Error;
};

// An invalid request: NaN coordinate, unknown cell or route, a budget below the floor. Exit code 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

}  // namespace filiform
