#include "index/containers/internal/mouselight_file.h"
#include "index/formats/internal/graph_file.h"
#include "tests/fuzz/fuzz_bytes.h"

namespace filiform::fuzz {

// A MouseLight file: finds its neurons, and reads each.
void fuzzJson(Input input) {
  static MemoryFile file;
  file.hold(input);
  const MouseLightFile neurons(file.path());
  require(neurons.file_bytes() == input.size(), "all of the file is read");
  const auto reader = neurons.reader();
  for (const ArchiveEntry& entry : neurons.entries()) {
    require(entry.index <= input.size() && entry.bytes <= input.size() - entry.index, "a neuron lies inside the file");
    std::string text;
    reader->read(entry, [&](std::string_view block) { text += block; });
    require(text.size() == entry.bytes && text.front() == '{' && text.back() == '}', "a neuron is an object");
    Cell cell;
    readGraph(text, "fuzz", GraphFormat::kMouseLight, {}, cell);
    require(cell.isGraph() || cell.parents.size() == cell.samples(), "a cell is a forest or has links");
  }
}

}  // namespace filiform::fuzz
