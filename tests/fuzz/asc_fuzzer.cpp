#include "index/formats/internal/graph_file.h"
#include "tests/fuzz/fuzz_bytes.h"

namespace filiform::fuzz {

// A Neurolucida file, with and without links of somata. The first byte says whether points are in nm.
void fuzzAsc(Input input) {
  Taker in(input);
  GraphOptions options;
  if (in.number<std::uint8_t>() % 2 == 1) options.units.unit_um = 1e-3;
  const std::string_view text = asText(in.rest());
  Cell linked, apart;
  const InputReport with = readGraph(text, "fuzz", GraphFormat::kNeurolucida, options, linked);
  options.units.soma_links = false;
  const InputReport without = readGraph(text, "fuzz", GraphFormat::kNeurolucida, options, apart);
  require(!linked.isGraph() && !apart.isGraph(), "trees and somata make no loop");
  require(with.samples == without.samples && linked.positions_um == apart.positions_um, "soma links add no sample");
  require(with.segments <= without.segments + with.codes[InputCode::SOMA_LINK], "each soma link is counted");
  require(without.codes[InputCode::SOMA_LINK] == 0, "no soma link without the option");
}

}  // namespace filiform::fuzz
