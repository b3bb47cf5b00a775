#include "tools/commands/shared/growth_report.h"

#include "index/text.h"
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

}  // namespace filiform::tools
