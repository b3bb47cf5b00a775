// What the name of an archive's entry says about it. Thread rule: pure functions, any thread.
#pragma once

#include "index/containers/internal/container.h"

#include <optional>
#include <string_view>

namespace filiform::internal {

// The entry as a report names it; nullopt for a folder. A file that is not read in folders, `._*` and those below
// `__MACOSX` are passed over. Inner archives, names that leave the archive, and links of any name are skipped. Index
// and sizes of the result are 0. O(length).
std::optional<ArchiveEntry> entryOfName(std::string_view raw_name, bool is_link);

}  // namespace filiform::internal
