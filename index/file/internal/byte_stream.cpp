#include "index/file/internal/byte_stream.h"

#include "index/file/internal/digest.h"
#include "index/file/internal/file_parts.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <vector>

namespace filiform::internal {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 16;

bool isSpace(int c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

}  // namespace

struct ByteStream::Source {
  std::optional<FileParts> file;  // none for a text, which is complete from the start
  std::function<void(std::uint64_t)> progress;
  std::vector<char> block;
  RunningDigest digest;
};

ByteStream::ByteStream(std::string_view bytes)
    : source_(std::make_unique<Source>()), at_(bytes.data()), end_(bytes.data() + bytes.size()) {
  source_->digest.add(bytes);
}

ByteStream::ByteStream(const std::string& path, std::function<void(std::uint64_t)> progress)
    : source_(std::make_unique<Source>()) {
  source_->file.emplace(path);
  source_->progress = std::move(progress);
  source_->block.resize(kBlock);
}

ByteStream::~ByteStream() = default;

bool ByteStream::fill() {
  Source& s = *source_;
  const std::size_t n = s.file ? s.file->next(s.block) : 0;
  if (n == 0) return false;
  s.digest.add(std::string_view(s.block.data(), n));
  at_ = s.block.data();
  end_ = at_ + n;
  if (s.progress) s.progress(n);
  return true;
}

std::string_view ByteStream::head(std::size_t n) {
  peek();
  return std::string_view(at_, static_cast<std::size_t>(end_ - at_)).substr(0, n);
}

bool ByteStream::readLine(std::string_view& line, std::size_t limit, bool& too_long) {
  text_.clear();
  nuls_ = too_long = false;
  if (peek() == kEnd) return false;
  for (int c; (c = get()) != kEnd && c != '\n';) {
    if (c == '\r') {
      if (peek() == '\n') get();
      break;
    }
    nuls_ |= c == 0;
    if (text_.size() < limit) {
      text_ += static_cast<char>(c);
    } else {
      too_long = true;
    }
  }
  line = text_;
  return true;
}

bool ByteStream::readToken(std::string_view& token, bool across_lines) {
  text_.clear();
  nuls_ = false;
  int c = peek();
  while (c != kEnd && isSpace(c) && (across_lines || (c != '\n' && c != '\r'))) get(), c = peek();
  if (c == kEnd || isSpace(c)) return false;
  for (; c != kEnd && !isSpace(c); get(), c = peek()) {
    nuls_ |= c == 0;
    if (text_.size() < kMaxToken) text_ += static_cast<char>(c);
  }
  token = text_;
  return true;
}

bool ByteStream::read(void* out, std::size_t n) {
  auto* to = static_cast<char*>(out);
  while (n > 0) {
    if (at_ == end_ && !fill()) return false;
    const std::size_t some = std::min(n, static_cast<std::size_t>(end_ - at_));
    std::memcpy(to, at_, some);
    at_ += some;
    to += some;
    n -= some;
  }
  return true;
}

bool ByteStream::skip(std::uint64_t n) {
  while (n > 0) {
    if (at_ == end_ && !fill()) return false;
    const std::uint64_t some = std::min<std::uint64_t>(n, static_cast<std::uint64_t>(end_ - at_));
    at_ += some;
    n -= some;
  }
  return true;
}

std::uint64_t ByteStream::digest() {
  do at_ = end_;
  while (fill());
  return source_->digest.value();
}

}  // namespace filiform::internal
