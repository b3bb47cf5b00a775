// --unit: in which unit a file's positions are. Thread rule: thread-compatible.
#pragma once

#include "index/input/swc.h"

#include <string>

namespace filiform::tools {

// What --unit takes, for help texts.
inline constexpr const char* kUnitHelp =
    "unit of the files: um, nm, mm; or the size of a voxel, as 8nm or 0.5 (um), or as 8,8,30nm by axis";

// "um", "nm", "mm"; the size of a voxel as a number with one of these, or without, then in um: "8nm", "0.5"; or its
// sizes along x, y and z, a unit after the last counts for all: "8,8,30nm", "4,4,40". Sets unit_um, or voxel_um where
// there are three. Throws UsageError naming --unit and the forms.
void readUnit(const std::string& text, SwcOptions& options);

}  // namespace filiform::tools
