// NeuroMorpho.Org archives hold each neuron twice: as CNG version, which the repository standardised, and as its
// source. Reading both would double the tissue. Thread rule: pure functions, any thread.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace filiform {

enum class MorphologyVersion : std::uint8_t { cng, source, both };

// For each path, with `/` between folders: whether `wanted` leaves it out.
//
// The layout is recognised by pairs, in any letter case: `NAME.CNG.swc`, and `NAME.swc` or `NAME.asc` in the same
// folder, in a folder beside it, or one level above or below, as in `CNG version/NAME.CNG.swc` and
// `Source-Version/NAME.swc`. A file without a partner is never left out.
//
// An ASC file beside an SWC file of the same name is left out too, unless `both` is wanted, and an H5 file beside
// either: collections hold each cell in several formats. Beside means the same folder, or folders `swc`, `asc` and `h5`
// (or `h5v1`) in one folder. O(total length) expected.
std::vector<bool> versionsLeftOut(const std::vector<std::string_view>& paths, MorphologyVersion wanted);

}  // namespace filiform
