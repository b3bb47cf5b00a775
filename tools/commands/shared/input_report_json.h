// Writes input reports as JSON, for `ingest --report`.
#pragma once

#include "index/input/input.h"

#include <iosfwd>
#include <vector>

namespace filiform::tools {

// Writes an array with one object a source, record by record: memory does not grow with the number of records. The
// caller checks the stream for errors. Throws IoError if records cannot be read back.
void writeReportJson(std::ostream& out, const std::vector<SourceReport>& reports);

}  // namespace filiform::tools
