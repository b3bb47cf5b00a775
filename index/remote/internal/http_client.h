// HttpClient: reads files and parts of files over HTTP, and sends files to an object store. One thread of its own runs
// all requests (libcurl's multi interface) and keeps connections open.
// A coding of the transport (Content-Encoding: gzip, and what else libcurl knows) is undone, though none is asked for;
// a part of a file in a coding is an error. Limits of size hold for the plain bytes.
//
// Ranges of one file that wait at the same time and lie close together become one request. A request that fails for a
// passing reason (no connection, a stall, a cut answer, 429, 5xx) is tried again, with growing waits, until the
// deadline. The token goes only to the origin that the client was made for, also after redirects.
#pragma once

#include "index/file/internal/bytes.h"
#include "index/remote/internal/s3_account.h"
#include "index/remote/remote_options.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform::internal {

// Thread rule: internally synchronised; no call may be under way when it is destroyed. The calls wait for their answer.
// They throw IoError with one line that names the URL, NotOnServer or DeniedByServer (http_errors.h) for these answers,
// and Interrupted if RemoteOptions::cancel is set.
class HttpClient {
 public:
  // `origin`: as originOf(). `account`: requests to the origin are for an object store, and signed if it has keys.
  // Throws UsageError if an option is out of range.
  HttpClient(std::string origin, const RemoteOptions& options, std::shared_ptr<const S3Account> account = nullptr);
  ~HttpClient();

  // Fills all of `bytes` from `offset` of the file on. Throws CorruptSet if the file ends too soon.
  void readRange(const std::string& url, std::uint64_t offset, std::span<std::uint8_t> bytes);
  // Reads the whole file. Throws IoError if it has more than `most` bytes.
  Bytes readWhole(const std::string& url, std::uint64_t most);
  // Asks for the size of the file, bytes.
  std::uint64_t size(const std::string& url) { return facts(url).bytes; }
  struct FileFacts {
    std::uint64_t bytes = 0;
    std::string digest{};  // that an object was stored with (`x-amz-meta-xxh3`); empty: none
  };
  FileFacts facts(const std::string& url);

  struct Request {
    std::string method, url;
    std::span<const std::uint8_t> body{};  // must live until the answer
    std::vector<std::string> headers{};    // `NAME: VALUE`; they are signed
  };
  struct Reply {
    std::string body;  // at most 1 MiB
    std::string tag;   // ETag
  };
  // Sends a request that may be repeated, because it has the same effect again. Returns the answer if it is 2xx.
  Reply send(const Request& request);

  RemoteCounters counters() const;  // without cache_hits

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::internal
