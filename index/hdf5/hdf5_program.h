// Where the program filiform-hdf5 lies, which reads HDF5 files in a process of its own.
//
// A program that uses the libraries usually needs none of this: the installed CMake package defines
// FILIFORM_HDF5_PROGRAM, and every source that includes a reader of HDF5 files then names that program.
#pragma once

#include <string>

namespace filiform {

// Names the program, to be used if it is found nowhere else (tools/FORMATS.md has the order). Call it before the first
// file is read. Returns true. Thread rule: internally synchronised.
bool nameHdf5Program(const std::string& path);

#ifdef FILIFORM_HDF5_PROGRAM
inline const bool kHdf5ProgramIsNamed = nameHdf5Program(FILIFORM_HDF5_PROGRAM);
#endif

}  // namespace filiform
