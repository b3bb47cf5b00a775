// S3Upload: sends a file to an object store, in parts if it is large.
#pragma once

#include "index/remote/internal/http_client.h"
#include "index/remote/internal/remote_address.h"

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace filiform::internal {

// Thread rule: thread-compatible. Throws IoError, and what `read` throws.
class S3Upload {
 public:
  static constexpr std::uint64_t kPart = 8 << 20, kOnePart = 16 << 20;  // a smaller file is sent at once
  static constexpr unsigned kAtOnce = 8;                                // parts
  static constexpr std::uint64_t kMostParts = 10'000;

  using Read = std::function<void(std::uint64_t offset, std::span<std::uint8_t> bytes)>;
  // Bytes that the store has, as they arrive. Called on the thread that calls send().
  using Progress = std::function<void(std::uint64_t done)>;

  // Both must outlive this object. `address` is that of a set in an object store.
  S3Upload(HttpClient& client, const RemoteAddress& address) : client_(client), address_(address) {}

  // Sends the file `name`, relative to the set, of `bytes`. `digest`: stored with it, as HttpClient::facts() returns.
  // `read` is called from several threads. Parts of an earlier upload of this file are used if the store lists them.
  void send(const std::string& name, std::uint64_t bytes, const std::string& digest, const Read& read,
            const Progress& progress);

  // The size of parts for a file: kPart, or more where kMostParts would not suffice.
  static std::uint64_t partBytes(std::uint64_t file_bytes);

 private:
  struct Begun {
    std::string id;
    std::vector<std::string> tags;  // of each part; empty: not there
  };
  Begun begin(const std::string& name, std::uint64_t bytes, const std::string& digest);
  Begun resume(const std::string& name, std::uint64_t bytes);
  void finish(const std::string& name, std::uint64_t bytes, const Begun& upload);

  HttpClient& client_;
  const RemoteAddress& address_;
};

}  // namespace filiform::internal
