// What ingest and compact print about the set that they made.
#pragma once

#include "index/ingest/growth.h"
#include "index/input/source_report.h"

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform::tools {

// Whole lines. Pure functions.
std::string reportOf(const std::string& path, const IngestResult& result);
std::string reportOf(const std::string& path, const GrowthResult& result);
std::string reportOf(const std::string& path, const SyncResult& result);
// The object of `ingest --json`. `sync`: null if the set did not follow its inputs.
nlohmann::ordered_json ingestJson(const IngestResult& result, const std::vector<SourceReport>& reports,
                                  const SyncCounts* sync);

}  // namespace filiform::tools
