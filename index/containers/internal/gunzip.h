// Decompresses gzip data (RFC 1952), whose checksums and sizes are compared. Thread rule: thread-compatible.
#pragma once

#include "index/reports/input_report.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace filiform::internal {

class Gunzip {
 public:
  using Sink = std::function<void(std::string_view)>;

  Gunzip();
  ~Gunzip();
  Gunzip(const Gunzip&) = delete;
  Gunzip& operator=(const Gunzip&) = delete;

  // Passes the content of the next bytes to `sink`, in blocks of 64 KiB at most. Members may follow each other; zeros
  // may follow the last one. Returns E_ZIP_FORMAT for other data, E_ZIP_CRC for damage; no call may follow. Throws what
  // `sink` throws.
  std::optional<InputCode> feed(std::string_view bytes, const Sink& sink);
  // Ends the input: E_ZIP_TRUNCATED within a member or without one.
  std::optional<InputCode> finish() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Decompresses `bytes` into `text`. Also returns E_ZIP_SIZE beyond `most` bytes of content. O(content).
std::optional<InputCode> gunzip(std::string_view bytes, std::uint64_t most, std::string& text);

// Passes the content of a gzip file to `sink`. `progress` receives the size of each block read on disk. Throws IoError,
// and what both throw.
std::optional<InputCode> gunzipFile(const std::string& path, const Gunzip::Sink& sink,
                                    const std::function<void(std::uint64_t bytes)>& progress);

// The content's size as the last member states it, modulo 2^32; nullopt if the file is too short or cannot be read.
std::optional<std::uint32_t> statedSize(const std::string& path);

}  // namespace filiform::internal
