// Splits text that arrives in blocks into lines (LF, CRLF or lone CR). It holds at most one data line of bounded
// length; comment lines of any length pass through. Blank lines are counted but not reported. Thread rule:
// thread-compatible.
//
// The sink has these functions. Lines count from 1; views are valid during the call.
//   void dataLine(std::string_view text, bool has_nul, std::uint64_t line);
//   void longLine(std::string_view start, std::uint64_t line);   a data line of more than `max_line` bytes
//   void comment(std::string_view start, bool has_nul, std::uint64_t line);   from `#` on, cut near `max_line` bytes
//   void loneCarriageReturn(std::uint64_t line);
#pragma once

#include "index/formats/swc/internal/swc_fields.h"

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace filiform::internal {

template <class Sink>
class LineSplitter {
 public:
  LineSplitter(Sink& sink, std::size_t max_line) : sink_(&sink), max_line_(max_line) {}

  // O(bytes).
  void feed(std::string_view bytes) {
    if (bytes.empty()) return;
    bytes_ += bytes.size();
    countNuls(bytes);
    const char* at = bytes.data();
    const char* const end = at + bytes.size();
    if (pending_cr_) {
      pending_cr_ = false;
      if (*at == '\n') {
        ++at;
        crlf_ = true;
      } else {
        sink_->loneCarriageReturn(line_);
      }
    }
    const char* lf = find(at, end, '\n');
    const char* cr = find(at, end, '\r');
    while (at < end) {
      if (lf < at) lf = find(at, end, '\n');
      if (cr < at) cr = find(at, end, '\r');
      const char* const stop = lf < cr ? lf : cr;
      const std::string_view text(at, static_cast<std::size_t>(stop - at));
      if (stop == end) {
        holdBack(text);
        return;
      }
      ++line_;
      if (holding()) {
        holdBack(text);
        releaseHeld();
      } else {
        wholeLine(text);
      }
      at = stop + 1;
      if (*stop == '\n') continue;
      if (at == end) {
        pending_cr_ = true;
      } else if (*at == '\n') {
        ++at;
        crlf_ = true;
      } else {
        sink_->loneCarriageReturn(line_);
      }
    }
  }

  // Ends the input and reports a last line without an end. A CR at the end of the file counts as a CRLF if other lines
  // end in CRLF.
  void finish() {
    if (pending_cr_ && !crlf_) sink_->loneCarriageReturn(line_);
    pending_cr_ = false;
    if (!holding()) return;
    ++line_;
    releaseHeld();
  }

  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t nuls() const { return nuls_; }

 private:
  // What is known about the line being held.
  enum class Held { kNothing, kText, kBlanks, kComment, kLongLine };

  static const char* find(const char* at, const char* end, char c) {
    const void* found = at == end ? nullptr : std::memchr(at, c, static_cast<std::size_t>(end - at));
    return found == nullptr ? end : static_cast<const char*>(found);
  }

  static const char* skipBlanks(const char* at, const char* end) {
    while (at < end && isBlank(*at)) ++at;
    return at;
  }

  void countNuls(std::string_view bytes) {
    const char* const end = bytes.data() + bytes.size();
    for (const char* at = find(bytes.data(), end, '\0'); at < end; at = find(at + 1, end, '\0')) ++nuls_;
  }

  bool hasNul(std::string_view text) const { return nuls_ > 0 && text.find('\0') != std::string_view::npos; }

  void wholeLine(std::string_view text) {
    const char* const end = text.data() + text.size();
    const char* const first = skipBlanks(text.data(), end);
    if (first == end) return;
    if (*first == '#') {
      sink_->comment({first, static_cast<std::size_t>(end - first)}, hasNul(text), line_);
    } else if (text.size() > max_line_) {
      sink_->longLine(text.substr(0, max_line_), line_);
    } else {
      sink_->dataLine(text, hasNul(text), line_);
    }
  }

  bool holding() const { return held_kind_ != Held::kNothing; }

  void holdBack(std::string_view text) {
    if (text.empty()) return;
    held_nul_ = held_nul_ || hasNul(text);
    if (held_kind_ == Held::kNothing) held_kind_ = Held::kText;
    if (held_kind_ == Held::kBlanks) {
      const char* const end = text.data() + text.size();
      const char* const first = skipBlanks(text.data(), end);
      if (first == end) return;
      held_kind_ = *first == '#' ? Held::kComment : Held::kLongLine;
      text = {first, static_cast<std::size_t>(end - first)};
    }
    const std::size_t room = max_line_ + 1 - held_.size();
    held_.append(text.substr(0, room));
    if (held_kind_ != Held::kText || held_.size() <= max_line_) return;
    const char* const end = held_.data() + held_.size();
    const char* const first = skipBlanks(held_.data(), end);
    if (first < end) {
      held_kind_ = *first == '#' ? Held::kComment : Held::kLongLine;
      return;
    }
    // Only blanks so far: drop them and look at the remaining bytes.
    held_.clear();
    held_kind_ = Held::kBlanks;
    if (text.size() > room) holdBack(text.substr(room));
  }

  void releaseHeld() {
    const char* const end = held_.data() + held_.size();
    const char* const first = skipBlanks(held_.data(), end);
    if (first < end) {
      if (*first == '#') {
        sink_->comment({first, static_cast<std::size_t>(end - first)}, held_nul_, line_);
      } else if (held_kind_ == Held::kLongLine) {
        sink_->longLine(held_, line_);
      } else {
        sink_->dataLine(held_, held_nul_, line_);
      }
    }
    held_.clear();
    held_kind_ = Held::kNothing;
    held_nul_ = false;
  }

  Sink* sink_;
  std::size_t max_line_;
  std::uint64_t bytes_ = 0, nuls_ = 0, line_ = 0;
  std::string held_;
  Held held_kind_ = Held::kNothing;
  bool held_nul_ = false;
  bool pending_cr_ = false, crlf_ = false;
};

}  // namespace filiform::internal
