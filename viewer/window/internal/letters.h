// The letters of the panels: collects the characters that are needed, and builds Dear ImGui's font atlas with them.
//
// Latin, Greek, Cyrillic, arrows and mathematical signs are always in the atlas, if the system has a font with them. A
// script such as Chinese has too many characters: they are added when they are first shown. A character that no font
// has is shown as a replacement sign.
//
// Thread rule: the thread of the panels; needs a Dear ImGui context.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

class Letters {
 public:
  // Font files, the preferred one first. Without any, the built-in font is used: Latin-1 only.
  explicit Letters(std::vector<std::filesystem::path> fonts) : fonts_(std::move(fonts)), bytes_(fonts_.size()) {}

  // Adds the characters of a text that will be shown. Characters above U+FFFF are ignored.
  void want(std::string_view utf8);
  bool isStale() const { return stale_; }  // build() would add characters
  // Builds the atlas again, for lines of about `scale` times 15 pixels. Reads each font file once, when it is first
  // needed; skips files that cannot be read. The object must live until the next build or the end of the atlas.
  void build(double scale);

 private:
  const std::string& bytesOf(std::size_t font);

  std::vector<std::filesystem::path> fonts_;
  std::vector<std::optional<std::string>> bytes_;  // of each font, once read; an empty text: unusable
  std::set<std::uint16_t> wanted_;                 // beyond those that are always in the atlas
  bool stale_ = true;
  std::vector<std::uint16_t> ranges_, wanted_ranges_;  // Dear ImGui reads these until the next build
};

}  // namespace filiform::internal
