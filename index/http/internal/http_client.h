// HttpClient: reads files and parts of files over HTTP. One thread of its own runs all requests (libcurl's multi
// interface) and keeps connections open.
//
// Ranges of one file that wait at the same time and lie close together become one request. A request that fails for a
// passing reason (no connection, a stall, a cut answer, 429, 5xx) is tried again, with growing waits, until the
// deadline. The token goes only to the origin that the client was made for, also after redirects.
#pragma once

#include "index/file/internal/bytes.h"
#include "index/http/remote_options.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace filiform::internal {

// Thread rule: internally synchronised; no call may be under way when it is destroyed. The calls wait for their answer.
// They throw IoError with one line that names the URL, NotOnServer (http_errors.h) if there is no such file, and
// Interrupted if RemoteOptions::cancel is set.
class HttpClient {
 public:
  // `origin`: as originOf(). Throws UsageError if an option is out of range.
  HttpClient(std::string origin, const RemoteOptions& options);
  ~HttpClient();

  // Fills all of `bytes` from `offset` of the file on. Throws CorruptSet if the file ends too soon.
  void readRange(const std::string& url, std::uint64_t offset, std::span<std::uint8_t> bytes);
  // Reads the whole file. Throws IoError if it has more than `most` bytes.
  Bytes readWhole(const std::string& url, std::uint64_t most);
  // Asks for the size of the file, bytes.
  std::uint64_t size(const std::string& url);

  RemoteCounters counters() const;  // without cache_hits

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::internal
