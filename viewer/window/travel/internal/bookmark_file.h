// Bookmarks as CSV: name, cell, sample, x_um, y_um, z_um. Thread rule: values; functions without state.
#pragma once

#include "index/geometry/grid.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

struct BookmarkRow {
  std::string name, cell;                // of the cell; not read back: the place says where
  std::optional<std::int64_t> sample{};  // likewise
  Vector3d p_W;
};

// With a header line. Names with commas, quotes or line ends are quoted.
std::string bookmarksCsv(const std::vector<BookmarkRow>& rows);

struct ReadBookmarks {
  static constexpr std::size_t kMost = 10'000;
  std::vector<BookmarkRow> rows;  // the first kMost that have a name and a place
  std::uint64_t left_out = 0;     // other rows
};
// The header line names the columns, in any order, with tabs, commas or semicolons between. Throws UsageError without
// the columns name, x_um, y_um and z_um. O(text).
ReadBookmarks readBookmarks(std::string_view text);

}  // namespace filiform::internal
