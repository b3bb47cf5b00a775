#include "index/formats/swc/internal/swc_header.h"

#include "index/formats/swc/internal/swc_fields.h"
#include "index/text.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <string>
#include <utility>

namespace filiform::internal {
namespace {

bool isLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool isWordCharacter(char c) { return isLetter(c) || (c >= '0' && c <= '9') || c == '_' || (c & 0x80) != 0; }

// Takes the next run of word characters; empty at the end.
std::string_view takeWord(std::string_view& text) {
  std::size_t start = 0;
  while (start < text.size() && !isWordCharacter(text[start])) ++start;
  std::size_t end = start;
  while (end < text.size() && isWordCharacter(text[end])) ++end;
  const std::string_view word = text.substr(start, end - start);
  text.remove_prefix(end);
  return word;
}

// Reads one or three numbers between blanks, commas, semicolons, `:`, `=` and brackets. nullopt for any other count.
std::optional<Vector3d> readTriple(std::string_view text) {
  constexpr std::string_view kBetween = " \t,;:=()[]";
  std::array<double, 3> values{};
  std::size_t count = 0;
  while (count < 3) {
    const std::size_t start = text.find_first_not_of(kBetween);
    if (start == std::string_view::npos) break;
    text.remove_prefix(start);
    const std::string_view token = text.substr(0, text.find_first_of(kBetween));
    if (readReal(token, values[count]) != RealKind::kFinite) break;
    ++count;
    text.remove_prefix(token.size());
  }
  if (count == 1) return Vector3d::Constant(values[0]);
  if (count == 3) return Vector3d(values[0], values[1], values[2]);
  return std::nullopt;
}

template <std::size_t N>
bool isOneOf(std::string_view word, const std::string_view (&words)[N]) {
  return std::find(std::begin(words), std::end(words), word) != std::end(words);
}

constexpr std::string_view kForeignUnits[] = {"pixel", "pixels",    "px",         "voxel",     "voxels",
                                              "nm",    "nanometer", "nanometers", "nanometre", "nanometres"};
constexpr std::string_view kMicrometres[] = {"um",         "micron",      "microns",   "micrometer", "micrometers",
                                             "micrometre", "micrometres", "\xC2\xB5m", "\xCE\xBCm",  "\xB5m"};

bool startsWith(std::string_view word, std::string_view start) { return word.substr(0, start.size()) == start; }

}  // namespace

HeaderLine readHeaderLine(std::string_view comment) {
  HeaderLine line;
  while (!comment.empty() && (comment.front() == '#' || isBlank(comment.front()))) comment.remove_prefix(1);
  if (comment.empty() || !isLetter(comment.front())) return line;

  std::string_view rest = comment;
  const std::string first = lowerCase(takeWord(rest));
  if (first == "scale") line.scale = readTriple(rest);
  if (first == "offset") line.offset = readTriple(rest);

  // Comments often mention pixels ("traced on a 512-pixel image"). Only lines about units or coordinates count. Of
  // several units, the first is that of the data: "in micrometers: voxel * size", "pixels of 0.2 um". But "um per
  // pixel" is the size of a pixel.
  bool about_units = first == "scale", in_um = false;
  std::string_view unit;
  std::string before;
  rest = comment;
  for (std::string_view raw = takeWord(rest); !raw.empty(); raw = takeWord(rest)) {
    std::string word = lowerCase(raw);
    if (startsWith(word, "unit") || startsWith(word, "coord") || startsWith(word, "position") || word == "xyz" ||
        (before == "in" && isOneOf(word, kMicrometres)))
      about_units = true;
    if (unit.empty() && isOneOf(word, kForeignUnits)) unit = raw;
    if (unit.empty() && isOneOf(word, kMicrometres)) {
      std::string_view ahead = rest;
      const std::string next = lowerCase(takeWord(ahead));
      if (next == "per" || (rest.starts_with('/') && !next.empty())) continue;
      in_um = true;
      break;
    }
    before = std::move(word);
  }
  line.in_um = about_units && in_um;
  if (about_units && !in_um) line.foreign_unit = unit;
  return line;
}

}  // namespace filiform::internal
