#include "index/containers/internal/nml_file.h"
#include "index/formats/internal/graph_file.h"
#include "tests/fuzz/fuzz_bytes.h"

namespace filiform::fuzz {

// An NML file: finds its trees, and reads each.
void fuzzNml(Input input) {
  static MemoryFile file;
  file.hold(input);
  const NmlFile trees(file.path());
  require(trees.file_bytes() == input.size(), "all of the file is read");
  const auto reader = trees.reader();
  for (const ArchiveEntry& entry : trees.entries()) {
    std::string text;
    reader->read(entry, [&](std::string_view block) { text += block; });
    require(text.size() == entry.bytes, "a tree has the bytes that it declares");
    GraphOptions options;
    options.units.apply_offset = input.size() % 2 == 0;
    Cell cell;
    readGraph(text, "fuzz", GraphFormat::kNml, options, cell);
    require(cell.isGraph() || cell.parents.size() == cell.samples(), "a cell is a forest or has links");
  }
}

}  // namespace filiform::fuzz
