// Writes input reports as JSON, for `--report` of ingest and check, and for `check --json`.
#pragma once

#include "index/ingest/growth.h"
#include "index/input/input.h"
#include "tools/commands/shared/anatomy_report.h"

#include <cstddef>
#include <iosfwd>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform::tools {

// What a report says of each source beside the record of reading; null: nothing.
using SyncFates = std::map<std::string, SyncFate>;
struct ReportExtras {
  const SyncFates* fates = nullptr;            // `sync`, of a set that follows its inputs
  const FindingsBySource* findings = nullptr;  // `anatomy`: what is odd about the cells
};

nlohmann::ordered_json countsJson(const CodeCounts& codes);
// Writes one object, record by record: memory does not grow with the number of records. `level`: the indentation of its
// closing brace. The caller checks the stream for errors. Throws IoError if records cannot be read back.
void writeSourceJson(std::ostream& out, const SourceReport& source, std::size_t level, const ReportExtras& extras = {});
// The same for an array with one object a source, and one for each source that the inputs have no longer.
void writeReportJson(std::ostream& out, const std::vector<SourceReport>& reports, const ReportExtras& extras = {});

}  // namespace filiform::tools
