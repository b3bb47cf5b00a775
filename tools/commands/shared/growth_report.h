// What ingest and compact print about the set that they made.
#pragma once

#include "index/ingest/growth.h"

#include <string>

namespace filiform::tools {

// One line each, with the end of the line. Pure functions.
std::string reportOf(const std::string& path, const IngestResult& result);
std::string reportOf(const std::string& path, const GrowthResult& result);

}  // namespace filiform::tools
