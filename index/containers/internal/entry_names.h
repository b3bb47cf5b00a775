// What the name of an archive's entry says about it. Thread rule: pure functions, any thread.
#pragma once

#include "index/containers/internal/container.h"

#include <optional>
#include <string_view>

namespace filiform::internal {

// Whether a file of this name holds SWC: *.swc, *.eswc (as Vaa3D writes), *.swc.txt. O(1).
bool namesSwc(std::string_view path);

// The entry if a report must name it: an SWC or *.asc, or an inner archive, which is skipped. nullopt for folders,
// `__MACOSX`, `._*` and all other files. Names that leave the archive, and links, are skipped too. Index and sizes of
// the result are 0. O(length).
std::optional<ArchiveEntry> entryOfName(std::string_view raw_name, bool is_link);

}  // namespace filiform::internal
