#include "index/containers/internal/catmaid_file.h"
#include "index/formats/internal/graph_file.h"
#include "tests/fuzz/fuzz_bytes.h"

namespace filiform::fuzz {

// A table of CATMAID: finds its skeletons, and reads each.
void fuzzCsv(Input input) {
  static MemoryFile file;
  file.hold(input);
  const CatmaidFile skeletons(file.path());
  require(skeletons.file_bytes() == input.size(), "all of the file is read");
  const auto reader = skeletons.reader();
  std::uint64_t bytes = 0;
  for (const ArchiveEntry& entry : skeletons.entries()) {
    std::string text;
    reader->read(entry, [&](std::string_view block) { text += block; });
    require(text.size() <= entry.bytes, "never more than the declared size");
    Cell cell;
    readGraph(text, "fuzz", GraphFormat::kCatmaid, {}, cell);
    require(cell.isGraph() || cell.parents.size() == cell.samples(), "a cell is a forest or has links");
    bytes += entry.packed_bytes;
  }
  require(bytes <= input.size(), "each line belongs to one skeleton");
}

}  // namespace filiform::fuzz
