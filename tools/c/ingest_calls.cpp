// filiform.h: ingest.
#include "index/ingest/ingest.h"
#include "index/remote/http_source.h"
#include "index/text.h"
#include "tools/c/call.h"
#include "tools/words/making/making.h"
#include "tools/words/unit.h"

#include <string>
#include <string_view>
#include <utility>
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
  return wanted;
}

void ingestCells(const std::vector<std::string>& paths, const std::string& output,
                 const filiform_ingest_options& options, filiform_ingest_result* result) {
  const ToldProgress progress(options);
  IngestOptions wanted = ingestOptionsFrom(options);
  tools::MakingOrder order{.inputs = paths, .output = output};
  order.reading.swc.apply_offset = options.apply_offset != 0;
  order.reading.swc.strict = options.strict != 0;
  if (options.unit != nullptr) tools::readUnit(options.unit, order.reading.swc);
  order.reading.progress = [&](std::uint64_t done, std::uint64_t total) { progress("reading", done, total); };
  if (options.placements != nullptr) order.placements.path = options.placements;
  if (options.attributes != nullptr) order.attributes.path = options.attributes;
  if (options.key != nullptr) order.key = options.key;
  if (options.population != nullptr) order.circuit.population = options.population;
  if (options.morphologies != nullptr) order.circuit.morphologies = options.morphologies;
  if (options.version != nullptr) order.reading.versions = tools::morphologyVersion(options.version, "version");
  order.reading.swc.soma_links = options.no_soma_links == 0;
  order.reading.one_cell_a_file = options.one_cell_a_file != 0;
  order.add = options.add != 0;
  order.sync = options.sync != 0;
  order.remove_gone = options.remove_gone != 0;
  tools::checkOrder(order, wanted.force);
  wanted.progress = [&progress](const char* phase, std::uint64_t done, std::uint64_t total) {
    if (std::string_view(phase) != "reading") progress(phase, done, total);  // the input tells it, in bytes
  };
  const tools::MakingResult all_made = tools::make(std::move(order), std::move(wanted));
  const IngestResult& made = all_made.set;
  if (result == nullptr) return;
  const InputTotals all = totals(all_made.reports);
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
