// makeSet: writes and publishes a set from the segments that a tiler gets.
#pragma once

#include "index/build/ingest_options.h"
#include "index/build/internal/set_folder.h"
#include "index/build/internal/tile_packer.h"
#include "index/build/internal/tiler.h"

#include <functional>
#include <memory>
#include <string>

namespace filiform::internal {

// Without trailing slashes.
std::string folderName(const std::string& path);
// Throws UsageError for options that cannot be. Returns the number of threads.
unsigned checkedThreads(const IngestOptions& options);
// Reports progress and throws Interrupted.
using Step = std::function<void(const char* phase, std::uint64_t done, std::uint64_t total)>;
Step stepOf(const IngestOptions& options);
std::uint64_t encodedMemory(const IngestOptions& options);  // for encoded tiles that wait, bytes

// The parts of makeSet().
TilerOptions tilerOptionsOf(const IngestOptions& options, unsigned threads, const std::string& folder,
                            const Step& step);
TilePacker::Options packerOptionsOf(const IngestOptions& options, unsigned threads, const std::string& folder,
                                    const Tiler& tiler);
IngestResult completeSet(SetFolder& folder, const IngestOptions& options, Tiler& tiler,
                         std::unique_ptr<TilePacker> packer, TileWriter& writer, const Provenance* provenance);

// `read` passes everything to the tiler. `options.force` has no meaning. Throws what ingest() throws.
IngestResult makeSet(SetFolder& folder, const IngestOptions& options, const std::function<void(Tiler& tiler)>& read);

}  // namespace filiform::internal
