// The columns of a table of skeletons that CATMAID exports (catmaid_table.h), and the values of its lines. Thread rule:
// pure functions, any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

// The places of the columns, from 0; kNone for one that is not there.
struct CatmaidColumns {
  static constexpr std::size_t kNone = SIZE_MAX;
  std::size_t skeleton = kNone, node = kNone, parent = kNone, x = kNone, y = kNone, z = kNone, radius = kNone;
  char separator = ',';

  // Of the first line of a table, with or without a byte order mark. O(length).
  static CatmaidColumns of(std::string_view header);
  bool isCatmaid() const { return skeleton != kNone || node != kNone; }
  bool isWhole() const { return missing().empty(); }
  std::string missing() const;  // the columns that are not there: "x, y"
};

// The values of a line, without quotes and the blanks around them. They refer to `line`. O(length).
void splitRow(std::string_view line, char separator, std::vector<std::string_view>& values);

}  // namespace filiform::internal
