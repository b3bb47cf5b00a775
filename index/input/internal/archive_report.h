// The report on an archive: its entries, and the sums over them. Thread rule: pure functions.
#pragma once

#include "index/input/input.h"
#include "index/input/internal/archive.h"

namespace filiform::internal {

// Replaces the entries of `row` by those of the archive, none of them read. O(entries).
void listEntries(const Archive& archive, SourceReport& row);
// Replaces the report of `row` by the sums over its entries. `strict`: refuse the archive on any code. O(entries).
void sumEntries(const Archive& archive, bool strict, SourceReport& row);

}  // namespace filiform::internal
