// Paths of the sources and of the built programs. The build writes the source file of these functions, so that no other
// source names a folder of this machine.
#pragma once

#include <string>

namespace filiform::test {

std::string inSource(const std::string& path);  // `path` below the top folder of the sources
std::string inBuild(const std::string& path);   // `path` below the build folder

}  // namespace filiform::test
