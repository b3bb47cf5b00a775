#include "tools/commands/shared/growth_report.h"

#include "index/input/input.h"
#include "index/text.h"
#include "tools/commands/shared/input_report_json.h"
#include "tools/words/numbers.h"

namespace filiform::tools {

std::string reportOf(const std::string& path, const IngestResult& result) {
  const SetCounts& n = result.counts;
  return escaped(path) + ": " + counted(n.cells, "cell") + ", " + counted(n.samples, "sample") + ", " +
         counted(n.segments, "segment") + " in " + counted(n.tiles, "tile") + ", " + formatBytes(result.bytes) +
         (result.unchanged ? " (unchanged: the same set as before)" : "") + "\n";
}

std::string reportOf(const std::string& path, const GrowthResult& result) {
  std::string text = reportOf(path, result.set);
  if (result.compacted) return text + "  all tiles were written anew\n";
  text += "  " + counted(result.tiles_written, "tile") + " written, " + formatCount(result.tiles_patched) +
          " patched, " + formatCount(result.tiles_kept) + " unchanged; filiform compact makes one set of all\n";
  if (result.levels_dropped) text += "  without levels of detail; filiform compact makes them again\n";
  return text;
}

std::string reportOf(const std::string& path, const SyncResult& result) {
  const SyncCounts& n = result.counts;
  std::string text = escaped(path) + ": " + counted(n.added, "new cell") + ", " + formatCount(n.changed) +
                     " changed, " + formatCount(n.equal) + " equal, " + formatCount(n.removed) + " removed\n";
  if (n.gone > 0)
    text += "  " + counted(n.gone, "cell") + " of the set " + (n.gone == 1 ? "is" : "are") +
            " no longer in the input and " + (n.gone == 1 ? "stays" : "stay") + "; --delete removes " +
            (n.gone == 1 ? "it" : "them") + "\n";
  if (n.held > 0)
    text += "  " + counted(n.held, "cell") + " " + (n.held == 1 ? "stays" : "stay") +
            " as before, because the input cannot be used now\n";
  if (n.renamed > 0) text += "  " + counted(n.renamed, "cell") + " renamed, so that names are those of one ingest\n";
  const bool rewritten = result.compacted || result.tiles_written + result.tiles_patched > 0;
  return text + (rewritten ? reportOf(path, static_cast<const GrowthResult&>(result)) : reportOf(path, result.set));
}

nlohmann::ordered_json ingestJson(const IngestResult& result, const std::vector<SourceReport>& reports,
                                  const SyncCounts* sync) {
  const InputTotals sum = totals(reports);
  nlohmann::ordered_json json{
      {"revision", result.revision},      {"cells", result.counts.cells},
      {"samples", result.counts.samples}, {"segments", result.counts.segments},
      {"tiles", result.counts.tiles},     {"bytes", result.bytes},
      {"unchanged", result.unchanged},    {"inputs", sum.accepted + sum.warned + sum.skipped + sum.refused},
      {"accepted", sum.accepted},         {"warned", sum.warned},
      {"skipped", sum.skipped},           {"refused", sum.refused},
      {"codes", countsJson(sum.codes)},   {"sync", nullptr}};
  if (sync != nullptr)
    json["sync"] = {{"new", sync->added},       {"changed", sync->changed}, {"equal", sync->equal},
                    {"removed", sync->removed}, {"gone", sync->gone},       {"held", sync->held},
                    {"renamed", sync->renamed}};
  return json;
}

}  // namespace filiform::tools
