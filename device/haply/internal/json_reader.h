// JsonReader: reads a JSON text from its begin to its end, without a tree and without memory of its own.
//
//   JsonReader in(text);
//   in.object([&](std::string_view key) {
//     if (key == "x") in.number(x);   // a value that is not read here is skipped
//   });
//   if (!in.ok()) ...                 // not JSON
//
// A value of another type than asked for is skipped, and the call returns false. The first error ends the reading.
// Keys and texts are given as they are written, without their escapes resolved. Thread rule: one thread.
#pragma once

#include <cstddef>
#include <string_view>

namespace filiform::internal {

class JsonReader {
 public:
  static constexpr int kMostDepth = 32;  // of nested values; deeper ones are an error

  explicit JsonReader(std::string_view text) noexcept : text_(text) {}

  bool ok() const noexcept { return ok_; }
  // True if everything was read without an error, and only blanks follow.
  bool atEnd() noexcept;

  // Calls `member(key)` for each member, with the reader at its value.
  template <typename Member>
  bool object(Member&& member) {
    if (!enter('{')) return false;
    for (bool first = true; ok_ && !leave('}', first); first = false) {
      const std::string_view key = text();
      expect(':');
      value([&] { member(key); });
    }
    return ok_;
  }
  // Calls `element()` for each element, with the reader at it.
  template <typename Element>
  bool array(Element&& element) {
    if (!enter('[')) return false;
    for (bool first = true; ok_ && !leave(']', first); first = false) value(element);
    return ok_;
  }
  bool number(double& out) noexcept;  // finite
  bool boolean(bool& out) noexcept;
  bool string(std::string_view& out) noexcept;  // valid as long as the text
  void skip() noexcept;

 private:
  template <typename Read>
  void value(Read&& read) {
    blanks();
    const std::size_t begin = at_;
    if (!ok_) return;
    read();
    if (ok_ && at_ == begin) skip();
  }
  void blanks() noexcept;
  bool next(char wanted) noexcept;
  void expect(char wanted) noexcept;
  bool enter(char bracket) noexcept;
  bool leave(char bracket, bool first) noexcept;
  std::string_view text() noexcept;
  std::string_view word() noexcept;
  void fail() noexcept;

  std::string_view text_;
  std::size_t at_ = 0;
  int depth_ = 0;
  bool ok_ = true;
};

}  // namespace filiform::internal
