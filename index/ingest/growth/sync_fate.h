// What becomes of cells when a set follows its inputs (index/ingest/growth.h). Thread rule: values.
#pragma once

#include <cstdint>
#include <string_view>

namespace filiform {

// What became of a source of cells: kHeld and kGone stay in the set.
enum class SyncFate : std::uint8_t {
  kNew,
  kChanged,  // its cells are replaced
  kEqual,
  kRemoved,
  kGone,  // its input has it no longer
  kHeld,  // it cannot be used now: refused, skipped, or passed over
};
std::string_view name(SyncFate fate);  // "new", "changed", "equal", "removed", "gone", "held"

// Cells by fate. `removed` includes those of a source that now has fewer cells. `renamed`: of those that stay.
struct SyncCounts {
  std::uint64_t added = 0, changed = 0, equal = 0, removed = 0, gone = 0, held = 0, renamed = 0;
};

}  // namespace filiform
