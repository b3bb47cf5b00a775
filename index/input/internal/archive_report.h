// The report on an archive: its entries, and the sums over them. Thread rule: pure functions.
#pragma once

#include "index/input/input.h"
#include "index/input/internal/archive.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform::internal {

// Replaces the entries of `row` by those of the archive, none of them read. O(entries).
void listEntries(const Archive& archive, SourceReport& row);
// The same with the morphologies of an H5 container, each taking about `bytes` of the file.
void listEntries(const std::vector<std::string>& names, std::uint64_t bytes, SourceReport& row);
// Replaces the report of `row` by the sums over its entries. `refusal`: of the archive itself. `strict`: refuse the
// archive on any warning. O(entries).
void sumEntries(std::optional<InputCode> refusal, bool strict, SourceReport& row);

}  // namespace filiform::internal
