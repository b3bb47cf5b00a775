#include "device/haply/internal/json_reader.h"

#include <charconv>
#include <cmath>

namespace filiform::internal {
namespace {

constexpr std::size_t kLongestNumber = 64;  // characters

bool isHex(char c) noexcept { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F'); }

// The grammar of RFC 8259, 6: from_chars alone would take "1.", "inf" and leading zeros.
bool isNumber(std::string_view word) noexcept {
  std::size_t at = 0;
  const auto digits = [&] {
    const std::size_t begin = at;
    while (at < word.size() && word[at] >= '0' && word[at] <= '9') ++at;
    return at > begin;
  };
  const auto skip = [&](const char* any) {
    const bool is = at < word.size() && std::string_view(any).find(word[at]) != std::string_view::npos;
    if (is) ++at;
    return is;
  };
  skip("-");
  if (at < word.size() && word[at] == '0')
    ++at;
  else if (!digits())
    return false;
  if (skip(".") && !digits()) return false;
  if (skip("eE")) {
    skip("+-");
    if (!digits()) return false;
  }
  return at == word.size();
}

}  // namespace

void JsonReader::fail() noexcept {
  ok_ = false;
  at_ = text_.size();
}

void JsonReader::blanks() noexcept {
  while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n' || text_[at_] == '\r'))
    ++at_;
}

bool JsonReader::atEnd() noexcept {
  blanks();
  return ok_ && at_ == text_.size();
}

bool JsonReader::next(char wanted) noexcept {
  blanks();
  if (at_ >= text_.size() || text_[at_] != wanted) return false;
  ++at_;
  return true;
}

void JsonReader::expect(char wanted) noexcept {
  if (!next(wanted)) fail();
}

bool JsonReader::enter(char bracket) noexcept {
  if (!next(bracket)) {
    skip();
    return false;
  }
  if (++depth_ > kMostDepth) fail();
  return ok_;
}

// Also takes the comma before a further value.
bool JsonReader::leave(char bracket, bool first) noexcept {
  if (next(bracket)) {
    --depth_;
    return true;
  }
  if (!first) expect(',');
  return false;
}

std::string_view JsonReader::text() noexcept {
  if (!next('"')) {
    fail();
    return {};
  }
  const std::size_t begin = at_;
  while (at_ < text_.size() && text_[at_] != '"') {
    const char c = text_[at_++];
    if (static_cast<unsigned char>(c) < 0x20) return fail(), std::string_view();
    if (c != '\\') continue;
    if (at_ >= text_.size()) break;
    const char escaped = text_[at_++];
    if (std::string_view("\"\\/bfnrtu").find(escaped) == std::string_view::npos) return fail(), std::string_view();
    if (escaped != 'u') continue;
    for (int i = 0; i < 4; ++i)
      if (at_ >= text_.size() || !isHex(text_[at_++])) return fail(), std::string_view();
  }
  if (at_ >= text_.size()) return fail(), std::string_view();
  return text_.substr(begin, at_++ - begin);
}

std::string_view JsonReader::word() noexcept {
  blanks();
  const std::size_t begin = at_;
  const auto isIn = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '+' || c == '-' ||
           c == '.';
  };
  while (at_ < text_.size() && isIn(text_[at_])) ++at_;
  return text_.substr(begin, at_ - begin);
}

bool JsonReader::number(double& out) noexcept {
  blanks();
  const std::size_t begin = at_;
  const std::string_view digits = word();
  double read = 0;
  if (digits.size() <= kLongestNumber && isNumber(digits)) {
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), read);
    if (error == std::errc() && end == digits.data() + digits.size() && std::isfinite(read)) {
      out = read;
      return true;
    }
  }
  at_ = begin;
  skip();
  return false;
}

bool JsonReader::boolean(bool& out) noexcept {
  blanks();
  const std::size_t begin = at_;
  const std::string_view read = word();
  if (read == "true" || read == "false") {
    out = read == "true";
    return true;
  }
  at_ = begin;
  skip();
  return false;
}

bool JsonReader::string(std::string_view& out) noexcept {
  blanks();
  if (at_ >= text_.size() || text_[at_] != '"') {
    skip();
    return false;
  }
  const std::string_view read = text();
  if (ok_) out = read;
  return ok_;
}

void JsonReader::skip() noexcept {
  blanks();
  if (!ok_ || at_ >= text_.size()) return fail();
  const char first = text_[at_];
  if (first == '{') {
    object([](std::string_view) {});
  } else if (first == '[') {
    array([] {});
  } else if (first == '"') {
    text();
  } else {
    const std::string_view read = word();
    if (read != "true" && read != "false" && read != "null" && !isNumber(read)) fail();
  }
}

}  // namespace filiform::internal
