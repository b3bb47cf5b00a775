#include "index/subsets/set_cells.h"

#include "index/set/internal/manifest.h"
#include "index/subsets/subset.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace filiform {
namespace {

// Ids ascend by source, then by digest, as ingest orders cells; a set that has grown has another order.
std::vector<std::uint32_t> inOrderOfIngest(const TileSet& set, std::vector<std::uint32_t> cells) {
  std::stable_sort(cells.begin(), cells.end(), [&](std::uint32_t a, std::uint32_t b) {
    const int order = set.cell(a).source.compare(set.cell(b).source);
    return order != 0 ? order < 0 : set.cellDigest(a) < set.cellDigest(b);
  });
  return cells;
}

void moveTo(Cell& cell, CellGraph graph) {
  cell = Cell{};
  for (std::uint32_t i = 0; i < graph.samples(); ++i) {
    cell.positions_um.push_back(graph.position_W(i));
    if (!std::isnan(graph.oddRadius_um(i))) cell.odd_radii.push_back({i, graph.oddRadius_um(i)});
  }
  cell.source = std::move(graph.source);
  cell.name = std::move(graph.name);
  cell.sample_ids = std::move(graph.sample_ids);
  if (graph.isGraph())
    cell.links = std::move(graph.links);
  else
    cell.parents = std::move(graph.parents);
  cell.radii_um = std::move(graph.radii_um);
  cell.types = std::move(graph.types);
  cell.block_starts = std::move(graph.block_starts);
  cell.header = std::move(graph.header);
}

}  // namespace

SetCells::SetCells(const TileSet& set, std::vector<std::uint32_t> cells, SetCellsOptions options)
    : set_(set),
      cells_(inOrderOfIngest(set, std::move(cells))),
      types_(std::move(options.types)),
      attributes_(set),
      pass_(set, cells_,
            {.memory_bytes = options.memory_bytes, .threads = options.threads, .check = std::move(options.check)}) {}

bool SetCells::next(Cell& cell) {
  while (at_ < cells_.size()) {
    CellGraph graph = pass_.next();
    const std::uint32_t id = cells_[at_++];
    if (!types_.empty()) {
      keepTypes(graph, types_);
      if (graph.samples() == 0) continue;
    }
    moveTo(cell, std::move(graph));
    cell.digest = set_.cellDigest(id);
    cell.attributes = attributes_.of(id);
    return true;
  }
  return false;
}

Provenance SetCells::provenance() const {
  Provenance provenance;
  provenance.sources = sourcesOfCells(set_, cells_);
  return provenance;
}

std::vector<Provenance::Source> sourcesOfCells(const TileSet& set, const std::vector<std::uint32_t>& cells) {
  const Provenance all = internal::decodeProvenance(set.readProvenance(), set.manifest());
  std::map<std::string_view, std::uint64_t> chosen;
  for (const Provenance::Source& source : all.sources) chosen.emplace(source.name, 0);
  for (const std::uint32_t cell : cells) {
    const std::string_view name = set.cell(cell).source;
    // A cell of an archive is named ARCHIVE/ENTRY.
    for (std::size_t end = name.size(); end != std::string_view::npos && end > 0; end = name.rfind('/', end - 1))
      if (const auto at = chosen.find(name.substr(0, end)); at != chosen.end()) ++at->second;
  }
  std::vector<Provenance::Source> sources;
  for (const Provenance::Source& source : all.sources)
    if (const std::uint64_t count = chosen.at(source.name); count > 0) {
      sources.push_back(source);
      sources.back().cells = count;
    }
  return sources;
}

}  // namespace filiform
