// HttpJob: a read over HTTP that a caller waits for, or something that it sends. Thread rule: values.
#pragma once

#include "index/file/internal/bytes.h"

#include <chrono>
#include <cstdint>
#include <exception>
#include <span>
#include <string>
#include <vector>

namespace filiform::internal {

struct HttpJob {
  enum class Kind : std::uint8_t { range, whole, size, send };
  using Clock = std::chrono::steady_clock;

  Kind kind;
  std::string url{};
  std::uint64_t offset = 0;              // range: of the first byte
  std::span<std::uint8_t> bytes{};       // range: where the bytes go; undefined after a failure
  std::uint64_t most = 0;                // whole: a longer file is an error
  Bytes whole{};                         // whole: the file; send: the answer
  std::uint64_t size = 0;                // size: of the file
  std::string digest{};                  // size: that an object was stored with
  std::string method{};                  // send
  std::span<const std::uint8_t> body{};  // send
  std::vector<std::string> headers{};    // send
  std::string tag{};                     // send: ETag of the answer
  bool alone = false;                    // not to be merged with others
  bool background = false;               // bulk work: see background_reads.h
  bool gathering = false;                // not_before only waits for neighbours that can share the request
  int attempts = 0;                      // that failed
  Clock::time_point begun{}, not_before{};
  bool done = false;
  std::exception_ptr failure{};

  std::uint64_t end() const { return offset + bytes.size(); }
};

}  // namespace filiform::internal
