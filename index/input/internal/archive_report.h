// The report on an archive: its entries, and the sums over them. Thread rule: pure functions.
#pragma once

#include "index/input/input.h"
#include "index/input/internal/container.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform::internal {

// Replaces the entries of `row` by those of the archive, none of them read. O(entries).
void listEntries(const Container& archive, SourceReport& row);
// The same with the morphologies of an H5 container, each taking about `bytes` of the file.
void listEntries(const std::vector<std::string>& names, std::uint64_t bytes, SourceReport& row);
// Replaces the report of `row` by the sums over its entries. `container`: whose own refusal counts too; null for an H5
// container. `strict`: refuse the archive on any warning. O(entries).
void sumEntries(const Container* container, bool strict, SourceReport& row);

}  // namespace filiform::internal
