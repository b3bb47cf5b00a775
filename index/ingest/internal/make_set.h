// makeSet: writes and publishes a set from the segments that a tiler gets.
#pragma once

#include "index/ingest/ingest_options.h"
#include "index/ingest/internal/tiler.h"
#include "index/set/internal/set_folder.h"

#include <functional>
#include <string>

namespace filiform::internal {

// Without trailing slashes.
std::string folderName(const std::string& path);
// Throws UsageError for options that cannot be. Returns the number of threads.
unsigned checkedThreads(const IngestOptions& options);
// Reports progress and throws Interrupted.
using Step = std::function<void(const char* phase, std::uint64_t done, std::uint64_t total)>;
Step stepOf(const IngestOptions& options);

// `read` passes everything to the tiler. `building`: the folder's, known to all ranks. `folder`: nullptr for a rank
// other than 0; rank 0 writes what there is once, and publishes. `options.force` has no meaning. Throws what ingest()
// throws.
IngestResult makeSet(SetFolder* folder, const std::string& building, const IngestOptions& options,
                     const std::function<void(Tiler& tiler)>& read);

}  // namespace filiform::internal
