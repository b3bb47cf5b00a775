#include "index/cell/glob.h"

#include "index/text.h"

#include <cstddef>

namespace filiform {

namespace {

// One element of a pattern: its length there, and whether it matches a byte.
struct GlobElement {
  std::size_t length;
  bool matches;
};

GlobElement elementAt(std::string_view pattern, char c) {
  if (pattern[0] == '?') return {1, true};
  if (pattern[0] == '\\' && pattern.size() > 1) return {2, pattern[1] == c};
  if (pattern[0] != '[') return {1, pattern[0] == c};
  std::size_t at = 1;
  const bool negated = at < pattern.size() && (pattern[at] == '!' || pattern[at] == '^');
  at += negated ? 1 : 0;
  const std::size_t first = at;
  bool listed = false;
  const auto byte = [](char value) { return static_cast<unsigned char>(value); };
  for (; at < pattern.size() && (pattern[at] != ']' || at == first); ++at) {
    if (at + 2 < pattern.size() && pattern[at + 1] == '-' && pattern[at + 2] != ']') {
      listed = listed || (byte(pattern[at]) <= byte(c) && byte(c) <= byte(pattern[at + 2]));
      at += 2;
    } else {
      listed = listed || pattern[at] == c;
    }
  }
  if (at >= pattern.size()) return {1, c == '['};
  return {at + 1, listed != negated};
}

}  // namespace

// After a mismatch, the text that the last star stands for grows by one byte; earlier stars need not grow.
bool matchesGlob(std::string_view pattern, std::string_view name) {
  std::size_t p = 0, n = 0, after_star = std::string_view::npos, star_end = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      after_star = ++p;
      star_end = n;
      continue;
    }
    const GlobElement element = p < pattern.size() ? elementAt(pattern.substr(p), name[n]) : GlobElement{0, false};
    if (element.matches) {
      p += element.length;
      ++n;
    } else if (after_star != std::string_view::npos) {
      p = after_star;
      n = ++star_end;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

bool matchesName(std::string_view pattern, std::string_view name) {
  return matchesGlob(pattern, name) || matchesGlob(lowerCase(pattern), lowerCase(name));
}

}  // namespace filiform
