// Errors at the edges of the program, few and by cause. Each text names the file, line, tile or option, and what to do
// about it. The haptic tick never throws: it returns values.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace filiform {

// The base of all: what() is one line, safe to print (text that came from files is escaped before it gets here).
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Input that cannot be used, or a refusal: nothing to ingest, not a zip, an existing set without --force. Exit code 1.
class InputError : public Error {
 public:
  using Error::Error;
};

// A tile set whose bytes are not what was written: bad checksum, short file, impossible count. Exit code 1.
class CorruptSet : public Error {
 public:
  CorruptSet(const std::string& file, std::uint64_t offset, const std::string& what);
  const std::string& file() const { return file_; }
  std::uint64_t offset() const { return offset_; }

 private:
  std::string file_;
  std::uint64_t offset_;
};

// The same for one tile; `offset` is the position in its pack file.
class CorruptTile : public CorruptSet {
 public:
  CorruptTile(std::uint32_t tile, const std::string& file, std::uint64_t offset, const std::string& what);
  std::uint32_t tile() const { return tile_; }

 private:
  std::uint32_t tile_;
};

// The operating system said no: missing or unreadable file, disk full, read or write error. Exit code 3.
class IoError : public Error {
 public:
  IoError(const std::string& file, const std::string& what);
  // Appends the text of `error_number` (an errno value).
  IoError(const std::string& file, const std::string& what, int error_number);
  const std::string& reason() const { return reason_; }  // what() without the file
  // The process lacks a file descriptor, memory or room for temporary files: not the fault of an input.
  bool isShortage() const { return shortage_; }
  IoError& asShortage() {
    shortage_ = true;
    return *this;
  }

 private:
  std::string reason_;
  bool shortage_ = false;
};

// The reader of a pipe that results go to has gone, as `head` does when it has enough. Exit code 141, without a
// message: that of a program that SIGPIPE ends.
class ClosedPipe : public Error {
 public:
  using Error::Error;
};

// Work that was told to stop, by a signal as a rule. Exit code 128 + signal.
class Interrupted : public Error {
 public:
  using Error::Error;
};

// A request that makes no sense: NaN coordinate, unknown cell or route, a budget below the floor. Exit code 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

}  // namespace filiform
