// The letters of the panels: which characters are wanted, and the font atlas (Dear ImGui's) that has them.
//
// Latin, Greek, Cyrillic, arrows and mathematical signs are there from the start, if the system has such a font. A
// script such as Chinese has too many characters for that: those of the texts that are shown are added when they first
// appear. A character that no font has is shown as a replacement sign.
//
// Thread rule: the thread of the panels; needs a Dear ImGui context.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string_view>
#include <vector>

namespace filiform::internal {

class Letters {
 public:
  // Font files, the preferred one first; none: the built-in font, which has Latin-1 alone.
  explicit Letters(std::vector<std::filesystem::path> fonts) : fonts_(std::move(fonts)) {}

  // These characters will be shown.
  void want(std::string_view utf8);
  bool isStale() const { return stale_; }  // build() would add something
  // Makes the atlas anew, for lines of about `scale` times 15 pixels. Files that cannot be read are left out.
  void build(double scale);

 private:
  std::vector<std::filesystem::path> fonts_;
  std::set<std::uint16_t> wanted_;  // beyond those that are there from the start
  bool stale_ = true;
  std::vector<std::uint16_t> ranges_, wanted_ranges_;  // read by Dear ImGui until the next build
};

}  // namespace filiform::internal
