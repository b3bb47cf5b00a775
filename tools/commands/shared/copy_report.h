// What `push` and `pull` share: options, progress, report. Thread rule: as cli.h.
#pragma once

#include "index/stores/set_copy.h"

#include <functional>
#include <string>

namespace filiform::tools {

// Calls copy(options) with a line of progress.
CopyResult copyWithProgress(const char* title, CopyOptions options,
                            const std::function<CopyResult(const CopyOptions& options)>& copy);

// Prints the result for people, or as one JSON object. `there`: the set's place.
void printCopy(const std::string& there, const char* copied, const CopyResult& result, bool as_json);

}  // namespace filiform::tools
