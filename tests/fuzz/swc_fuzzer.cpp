#include "index/errors.h"
#include "index/formats/swc.h"
#include "tests/fuzz/fuzz_bytes.h"

namespace filiform::fuzz {
namespace {

bool equal(const Cell& a, const Cell& b) {
  const auto bits = [](float value) {
    std::uint32_t word;
    std::memcpy(&word, &value, sizeof word);
    return word;
  };
  return a.digest == b.digest && a.sample_ids == b.sample_ids && a.positions_um == b.positions_um &&
         a.parents == b.parents && a.links == b.links && a.types == b.types && a.block_starts == b.block_starts &&
         std::equal(a.radii_um.begin(), a.radii_um.end(), b.radii_um.begin(), b.radii_um.end(),
                    [&](float x, float y) { return bits(x) == bits(y); });
}

// Checks that every sample reaches a root.
bool acyclic(const Cell& cell) {
  std::vector<std::uint8_t> seen(cell.samples(), 0);  // 1: on the current path, 2: known to reach a root
  std::vector<std::uint32_t> way;
  for (std::uint32_t i = 0; i < cell.samples(); ++i) {
    std::uint32_t at = i;
    for (; at != kNoParent && seen[at] == 0; at = cell.parents[at]) seen[at] = 1, way.push_back(at);
    if (at != kNoParent && seen[at] == 1) return false;
    for (std::uint32_t done : way) seen[done] = 2;
    way.clear();
  }
  return true;
}

void requireCell(const Cell& cell) {
  const std::size_t n = cell.samples();
  require(cell.positions_um.size() == n && cell.radii_um.size() == n && cell.types.size() == n, "arrays of one length");
  require(cell.links.empty() && cell.parents.size() == n, "SWC gives a forest");
  for (std::size_t i = 0; i < n; ++i) {
    require(cell.positions_um[i].allFinite() && cell.positions_um[i].cwiseAbs().maxCoeff() <= Grid::kMaxCoordinate_um,
            "positions lie in range");
    require(cell.parents[i] == kNoParent || (cell.parents[i] < n && cell.parents[i] != i), "parents are samples");
  }
  require(acyclic(cell), "a forest has no loops");
}

}  // namespace

void fuzzSwc(Input input) {
  const std::string_view text = asText(input);
  // The length of the text chooses the options and the place of the cuts, because the seeds are plain SWC files.
  SwcOptions options;
  options.strict = input.size() % 5 == 4;
  options.apply_offset = input.size() % 3 == 2;
  if (input.size() % 7 == 6) options.unit_um = 1e-3;
  Cell whole, pieces;
  readSwc(text, "fuzz.swc", options, whole);
  requireCell(whole);
  SwcReader reader(options);
  for (std::size_t at = 0, step = 1; at < text.size(); at += step, step = step % 61 + 3)
    reader.feed(text.substr(at, step));
  reader.finish("fuzz.swc", pieces);
  require(equal(whole, pieces), "the same however the bytes are cut");
}

}  // namespace filiform::fuzz
