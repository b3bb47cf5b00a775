#include "viewer/window/internal/letters.h"

#include <cmath>
#include <fstream>
#include <imgui.h>
#include <iterator>
#include <memory>
#include <string>

namespace filiform::internal {

namespace {

static_assert(sizeof(ImWchar) == sizeof(std::uint16_t));

constexpr double kLine_px = 15, kBuiltInLine_px = 13;

// Characters that are always in the atlas, as pairs of first and last: Latin with extensions, Greek and Cyrillic, more
// Latin and Greek, punctuation to currencies, letter-like signs, arrows and mathematics, the replacement sign.
constexpr std::uint16_t kAlways[] = {0x0020, 0x024F, 0x0370, 0x052F, 0x1E00, 0x1FFF, 0x2010, 0x20BF,
                                     0x2100, 0x214F, 0x2190, 0x22FF, 0x25A0, 0x25FF, 0xFFFD, 0xFFFD};

bool isAlways(std::uint16_t character) {
  for (std::size_t i = 0; i < std::size(kAlways); i += 2)
    if (character >= kAlways[i] && character <= kAlways[i + 1]) return true;
  return character < 0x20;
}

// True for an OpenType file by its first bytes. Dear ImGui ends the program on other files.
bool isFont(const std::string& bytes) {
  for (const char* tag : {"OTTO", "true", "ttcf"})
    if (bytes.compare(0, 4, tag) == 0) return true;
  return bytes.compare(0, 4, std::string("\0\1\0\0", 4)) == 0;
}

}  // namespace

void Letters::want(std::string_view utf8) {
  for (std::size_t i = 0; i < utf8.size();) {
    const auto lead = static_cast<unsigned char>(utf8[i]);
    const std::size_t length = lead < 0xC0 ? 1 : lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
    // One byte is ASCII, always there; four bytes are above U+FFFF, which the atlas cannot hold.
    if ((length == 2 || length == 3) && i + length <= utf8.size()) {
      unsigned character = lead & (0xFFU >> (length + 1));
      for (std::size_t k = 1; k < length; ++k)
        character = character << 6U | (static_cast<unsigned char>(utf8[i + k]) & 0x3FU);
      const auto small = static_cast<std::uint16_t>(character);
      if (!isAlways(small) && wanted_.insert(small).second) stale_ = true;
    }
    i += length;
  }
}

void Letters::build(double scale) {
  stale_ = false;
  ImFontAtlas& atlas = *ImGui::GetIO().Fonts;
  atlas.Clear();
  ranges_.assign(std::begin(kAlways), std::end(kAlways));
  ranges_.push_back(0);
  wanted_ranges_.clear();
  for (const std::uint16_t character : wanted_) wanted_ranges_.insert(wanted_ranges_.end(), {character, character});
  wanted_ranges_.push_back(0);

  const auto size_px = static_cast<float>(std::round(kLine_px * scale));
  bool has_text = false;
  for (std::size_t font = 0; font < fonts_.size(); ++font) {
    if (has_text && wanted_.empty()) break;
    const std::string& bytes = bytesOf(font);
    if (bytes.empty()) continue;
    const auto add = [&](const std::vector<std::uint16_t>& ranges, bool merged) {
      ImFontConfig config;
      config.FontDataOwnedByAtlas = false;
      config.MergeMode = merged;
      config.OversampleH = 2;
      atlas.AddFontFromMemoryTTF(const_cast<char*>(bytes.data()), static_cast<int>(bytes.size()), size_px, &config,
                                 ranges.data());
    };
    if (!has_text) add(ranges_, false);
    if (!wanted_.empty()) add(wanted_ranges_, true);
    has_text = true;
  }
  if (!has_text) {
    ImFontConfig config;
    config.SizePixels = static_cast<float>(std::round(kBuiltInLine_px * scale));
    atlas.AddFontDefault(&config);
  }
  unsigned char* pixels = nullptr;
  int width = 0, height = 0;
  atlas.GetTexDataAsAlpha8(&pixels, &width, &height);  // builds the atlas now
}

const std::string& Letters::bytesOf(std::size_t font) {
  std::optional<std::string>& bytes = bytes_[font];
  if (!bytes) {
    std::ifstream in(fonts_[font], std::ios::binary);
    bytes.emplace(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    if (!isFont(*bytes)) bytes.emplace();
  }
  return *bytes;
}

}  // namespace filiform::internal
