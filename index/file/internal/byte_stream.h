// Reads the bytes of a file or a text in order, for formats that mix text and binary data. Thread rule:
// thread-compatible.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace filiform::internal {

class ByteStream {
 public:
  static constexpr std::size_t kMaxToken = 4096;  // longer tokens are cut: no valid token is longer

  explicit ByteStream(std::string_view bytes);
  // Reads `path` in blocks; `progress`, if given, receives the size of each. All members throw IoError naming the path,
  // and what `progress` throws.
  ByteStream(const std::string& path, std::function<void(std::uint64_t bytes)> progress);
  ~ByteStream();
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;

  static constexpr int kEnd = -1;
  int peek() { return at_ < end_ || fill() ? static_cast<unsigned char>(*at_) : kEnd; }
  int get() {
    const int c = peek();
    if (c != kEnd) {
      ++at_;
      line_ += c == '\n';
    }
    return c;
  }
  // The first `n` bytes at most, without consuming them. Call it before all other reads; n is at most one block.
  std::string_view head(std::size_t n);

  // Reads the rest of the line without its end (LF, CRLF, lone CR), cut at `limit` bytes. Returns false at the end of
  // the stream. `line` is valid until the next call.
  bool readLine(std::string_view& line, std::size_t limit, bool& too_long);
  // Reads the next token between blanks and line ends, cut at kMaxToken. Returns false at the end of the stream. Unless
  // `across_lines`, also returns false at the end of the line, without consuming the end. `token` is valid until the
  // next call.
  bool readToken(std::string_view& token, bool across_lines);
  // Reads exactly n bytes. Returns false if fewer are left.
  bool read(void* out, std::size_t n);
  bool skip(std::uint64_t n);

  std::uint64_t line() const { return line_; }  // line of the next byte, from 1; counts LF
  bool hasNul() const { return nuls_; }         // in the last line or token
  // XXH3 of all bytes; reads the rest of the stream.
  std::uint64_t digest();

 private:
  bool fill();

  struct Source;
  std::unique_ptr<Source> source_;
  const char* at_ = nullptr;
  const char* end_ = nullptr;
  std::uint64_t line_ = 1;
  bool nuls_ = false;
  std::string text_;
};

}  // namespace filiform::internal
