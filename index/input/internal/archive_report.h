// The report on an archive: its entries, and the sums over them. Thread rule: pure functions.
#pragma once

#include "index/containers/internal/container.h"
#include "index/input/source_report.h"

namespace filiform::internal {

// Replaces the entries of `row` by those of the archive, none of them read. O(entries).
void listEntries(const Container& archive, SourceReport& row);
// Replaces the report of `row` by the sums over its entries. `strict`: refuse the archive on any warning. O(entries).
void sumEntries(const Container& container, bool strict, SourceReport& row);

}  // namespace filiform::internal
