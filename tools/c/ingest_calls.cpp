// filiform.h: ingest.
#include "index/circuits/placements.h"
#include "index/count_text.h"
#include "index/ingest/growth.h"
#include "index/ingest/ingest.h"
#include "index/ingest/input_provenance.h"
#include "index/input/input.h"
#include "index/remote/http_source.h"
#include "index/text.h"
#include "tools/c/call.h"
#include "tools/words/unit.h"

#include <algorithm>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace filiform::c {

namespace {

constexpr std::uint32_t kMostCapacity = 1u << 30;

class ToldProgress {
 public:
  explicit ToldProgress(const filiform_ingest_options& options) : told_(options.progress), user_(options.user) {}
  void operator()(const char* phase, std::uint64_t done, std::uint64_t total) const {
    if (told_ != nullptr && told_(user_, phase, done, total) != 0)
      throw Interrupted("stopped by the progress callback; nothing was published");
  }

 private:
  filiform_progress told_;
  void* user_;
};

IngestOptions ingestOptionsFrom(const filiform_ingest_options& options) {
  IngestOptions wanted;
  if (options.capacity != 0) wanted.capacity = options.capacity;
  if (wanted.capacity > kMostCapacity) throw UsageError("capacity: give at most 2^30");
  wanted.threads = options.threads;
  if (options.memory_bytes != 0) wanted.memory = options.memory_bytes;
  if (wanted.memory < kMinIngestMemory) throw UsageError("memory_bytes: give at least 64 MiB");
  wanted.levels = options.no_levels == 0;
  wanted.force = options.force != 0;
  if (wanted.force && options.add != 0) throw UsageError("force replaces a set; leave it out with add");
  return wanted;
}

InputOptions inputOptionsFrom(const filiform_ingest_options& options, const IngestOptions& wanted,
                              const ToldProgress& progress) {
  InputOptions reading;
  reading.swc.apply_offset = options.apply_offset != 0;
  reading.swc.strict = options.strict != 0;
  if (options.unit != nullptr) tools::readUnit(options.unit, reading.swc);
  reading.memory = wanted.memory;
  reading.threads = wanted.threads != 0 ? wanted.threads : std::max(1u, std::thread::hardware_concurrency());
  if (options.placements != nullptr) reading.cell_share = kPlacedCellShare;
  reading.progress = [progress](std::uint64_t done, std::uint64_t total) { progress("reading", done, total); };
  return reading;
}

void ingestCells(const std::vector<std::string>& paths, const std::string& output,
                 const filiform_ingest_options& options, filiform_ingest_result* result) {
  const ToldProgress progress(options);
  IngestOptions wanted = ingestOptionsFrom(options);
  Input input(paths, inputOptionsFrom(options, wanted, progress));
  wanted.stream_bytes = input.held_bytes();
  wanted.reading_bytes = input.reading_bytes();
  std::optional<PlacedCells> placed;
  if (options.placements != nullptr) {
    placed.emplace(input, PlacementTable::read(options.placements));
    wanted.stream_bytes += placed->held_bytes();
  }
  const PlacedCells* const table = placed ? &*placed : nullptr;
  wanted.provenance = [&] {
    requireUsable(input.reports(), table, options.strict != 0);
    return provenanceOf(input.reports(), table);
  };
  wanted.progress = [&progress](const char* phase, std::uint64_t done, std::uint64_t total) {
    if (std::string_view(phase) != "reading") progress(phase, done, total);  // the input tells it, in bytes
  };
  CellStream& cells = placed ? static_cast<CellStream&>(*placed) : input;
  const IngestResult made = options.add != 0 ? addCells(cells, output, wanted).set : ingest(cells, output, wanted);
  if (result == nullptr) return;
  const InputTotals all = totals(input.reports());
  filiform_ingest_result told{};
  told.struct_size = result->struct_size;
  told.cells = made.counts.cells;
  told.samples = made.counts.samples;
  told.segments = made.counts.segments;
  told.tiles = made.counts.tiles;
  told.accepted = all.accepted;
  told.warned = all.warned;
  told.skipped = all.skipped;
  told.refused = all.refused;
  told.bytes = made.bytes;
  for (const auto& [ending, count] : all.passed_over) told.passed_over += count;
  *result = told;
}

}  // namespace

}  // namespace filiform::c

using namespace filiform;
using namespace filiform::c;

extern "C" int filiform_ingest(const char* const* inputs, size_t count, const char* output,
                               const filiform_ingest_options* options, filiform_ingest_result* result) {
  return call([&] {
    required(output, "output");
    if (isAddress(output)) throw UsageError("output: a set is written to a folder, not to an address");
    if (result != nullptr) sized(result, "result");
    const filiform_ingest_options wanted = optionsOr(options, "options");
    if (count == 0) throw UsageError("count: give at least one input");
    required(inputs, "inputs");
    std::vector<std::string> paths;
    for (size_t i = 0; i < count; ++i) paths.emplace_back(required(inputs[i], "inputs"));
    ingestCells(paths, output, wanted, result);
  });
}
