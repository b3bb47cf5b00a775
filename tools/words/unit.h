// --unit: the unit of the positions in a file. Thread rule: thread-compatible.
#pragma once

#include "index/formats/swc.h"

#include <string>

namespace filiform::tools {

// The forms of --unit, for help texts.
inline constexpr const char* kUnitHelp =
    "unit of the files: um, nm or mm; the size of a voxel, such as 8nm or 0.5 (um); or its sizes by axis: 8,8,30nm";

// Reads "um", "nm" or "mm"; the size of a voxel, "8nm" or "0.5" (um); or the sizes of a voxel along x, y and z,
// "8,8,30nm" or "4,4,40" (a unit after the last number applies to all three). Sets unit_um, or voxel_um if there are
// three numbers. Throws UsageError, which names --unit and the accepted forms.
void readUnit(const std::string& text, SwcOptions& options);

}  // namespace filiform::tools
