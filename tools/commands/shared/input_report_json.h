// Writes input reports as JSON, for `--report` of ingest and check, and for `check --json`.
#pragma once

#include "index/ingest/growth.h"
#include "index/input/input.h"

#include <cstddef>
#include <iosfwd>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform::tools {

nlohmann::ordered_json countsJson(const CodeCounts& codes);
// Writes one object, record by record: memory does not grow with the number of records. `level`: the indentation of its
// closing brace. The caller checks the stream for errors. Throws IoError if records cannot be read back.
// `fates`: not null: of the sources of a set that follows its inputs, each `sync` of its file or entry.
using SyncFates = std::map<std::string, SyncFate>;
void writeSourceJson(std::ostream& out, const SourceReport& source, std::size_t level,
                     const SyncFates* fates = nullptr);
// The same for an array with one object a source, and one for each source that the inputs have no longer.
void writeReportJson(std::ostream& out, const std::vector<SourceReport>& reports, const SyncFates* fates = nullptr);

}  // namespace filiform::tools
