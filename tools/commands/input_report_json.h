// The reports on inputs as JSON, for `ingest --report`.
#pragma once

#include "index/input/input.h"

#include <iosfwd>
#include <vector>

namespace filiform::tools {

// An array with one object for each source. Written record by record: memory does not grow with their number. Errors of
// the stream are the caller's to look at. Throws IoError where records cannot be read back.
void writeReportJson(std::ostream& out, const std::vector<SourceReport>& reports);

}  // namespace filiform::tools
