// Bytes of a file or a text, pulled one after the other by the readers of formats that mix text and binary.
// Thread-compatible.
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
  static constexpr std::size_t kMaxToken = 4096;  // what is longer is cut: nothing that is wanted is

  explicit ByteStream(std::string_view bytes);
  // Reads `path` in blocks; `progress`, if any, is told the bytes of each. Throws IoError naming the path, here and in
  // all others, and what `progress` throws.
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
  // The first bytes, at most `n`, without taking them. Only before anything was taken; n at most the block.
  std::string_view head(std::size_t n);

  // The rest of the line without its end (LF, CRLF, lone CR), cut at `limit` bytes; false at the end of the stream. The
  // view dies with the next call.
  bool readLine(std::string_view& line, std::size_t limit, bool& too_long);
  // The next run of bytes without blanks and line ends, cut at kMaxToken; false at the end, and, unless
  // `across_lines`, at the end of the line (which is not taken). The view dies with the next call.
  bool readToken(std::string_view& token, bool across_lines);
  // Exactly n bytes; false where there are fewer.
  bool read(void* out, std::size_t n);
  bool skip(std::uint64_t n);

  std::uint64_t line() const { return line_; }  // of the next byte, from 1; counts LF
  bool hasNul() const { return nuls_; }         // in the last line or token
  // XXH3 of all bytes; reads what is left.
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
