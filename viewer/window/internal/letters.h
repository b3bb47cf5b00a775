// The letters of the panels: which characters are wanted, and the font atlas (Dear ImGui's) that has them.
//
// Latin, Greek, Cyrillic, arrows and mathematical signs are there from the start, if the system has such a font. A
// script such as Chinese has too many characters for that: those of the texts that are shown are added when they first
// appear. A character that no font has is shown as a replacement sign.
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
  // Font files, the preferred one first; none: the built-in font, which has Latin-1 alone.
  explicit Letters(std::vector<std::filesystem::path> fonts) : fonts_(std::move(fonts)), bytes_(fonts_.size()) {}

  // These characters will be shown.
  void want(std::string_view utf8);
  bool isStale() const { return stale_; }  // build() would add something
  // Makes the atlas anew, for lines of about `scale` times 15 pixels. Reads each font file once, when it is first
  // needed; leaves out files that cannot be read. The object must outlive the atlas, or the next build.
  void build(double scale);

 private:
  const std::string& bytesOf(std::size_t font);

  std::vector<std::filesystem::path> fonts_;
  std::vector<std::optional<std::string>> bytes_;  // of each font, once read; empty: it cannot be used
  std::set<std::uint16_t> wanted_;                 // beyond those that are there from the start
  bool stale_ = true;
  std::vector<std::uint16_t> ranges_, wanted_ranges_;  // read by Dear ImGui until the next build
};

}  // namespace filiform::internal
