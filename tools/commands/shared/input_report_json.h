// Writes input reports as JSON, for `--report` of ingest and check, and for `check --json`.
#pragma once

#include "index/input/input.h"
#include "tools/commands/shared/anatomy_report.h"

#include <cstddef>
#include <iosfwd>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform::tools {

nlohmann::ordered_json countsJson(const CodeCounts& codes);
// Writes one object, record by record: memory does not grow with the number of records. `level`: the indentation of its
// closing brace. `findings`: adds what is odd about the anatomy of its cells, if not null. The caller checks the stream
// for errors. Throws IoError if records cannot be read back.
void writeSourceJson(std::ostream& out, const SourceReport& source, std::size_t level,
                     const FindingsBySource* findings = nullptr);
// The same for an array with one object a source.
void writeReportJson(std::ostream& out, const std::vector<SourceReport>& reports,
                     const FindingsBySource* findings = nullptr);

}  // namespace filiform::tools
