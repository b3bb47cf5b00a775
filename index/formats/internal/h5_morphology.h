// Reads H5 morphologies of version 1, single files and merged containers, through filiform-hdf5.
//
// `points`: x, y, z, diameter a row. `structure`: first point, type, parent section a row; section 0, of type 1, is the
// soma. Diameters are halved. Sample ids are rows of `points`, from 1. NeuriteSections states what becomes of the soma
// and of repeated points. Thread rule: thread-compatible.
#pragma once

#include "index/cell/cell.h"
#include "index/formats/swc.h"
#include "index/hdf5/internal/hdf5_process.h"
#include "index/reports/input_report.h"

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

// The names of the morphologies of a container, ascending; one empty name for a file of one morphology. Throws IoError.
std::vector<std::string> listH5Morphologies(Hdf5Process& process, const std::string& file);

// Reads one morphology into `cell`: all members but source. `check` receives the number of points read so far; its
// exceptions propagate. Throws IoError, ConservationError, InputError.
InputReport readH5Morphology(Hdf5Process& process, const std::string& file, const std::string& name,
                             const SwcOptions& options, const std::function<void(std::uint64_t points)>& check,
                             Cell& cell);

// The same from the arrays of a morphology. Every point with a position is kept, as in SWC: a section without points,
// or that begins before the one before it, is left out (W_ELEMENT), and what follows it continues its parent; the link
// to a parent that does not come before it is cut (W_MISSING_PARENT); a point of no section is dropped (W_BAD_LINE). A
// negative parent, or -1 of an unsigned array, is none.
InputReport h5Morphology(const std::vector<std::array<double, 4>>& points,
                         const std::vector<std::array<std::int64_t, 3>>& structure, std::string_view file,
                         const SwcOptions& options, Cell& cell);

}  // namespace filiform::internal
