#include "index/contacts/internal/site_places.h"

#include "index/contacts/closest_places.h"
#include "index/query/cell_pass.h"
#include "index/query/cell_paths.h"
#include "index/workers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace filiform::internal {
namespace {

constexpr double kNoSomaPath = std::numeric_limits<double>::infinity();

double stepLength_um(const CellGraph& cell, std::uint32_t a, std::uint32_t b) {
  return (cell.position_W(a) - cell.position_W(b)).norm();
}

struct SideOfSite {
  std::uint32_t cell;
  std::uint32_t site2;  // twice the site, and the side
};

void complete(ContactSite::Side& side, const CellGraph& cell, const std::vector<double>& lengths_um) {
  const SegmentEnds ends{cell.position_W(side.child), cell.position_W(side.parent)};
  side.p_W = ends.at(side.t);
  side.sample_id = cell.sample_ids[side.child];
  side.path_um = std::numeric_limits<double>::quiet_NaN();
  if (lengths_um.empty()) return;
  const double length_um = (ends.parent_W - ends.child_W).norm();
  const double path_um =
      std::min(lengths_um[side.child] + side.t * length_um, lengths_um[side.parent] + (1 - side.t) * length_um);
  if (path_um < kNoSomaPath) side.path_um = path_um;
}

}  // namespace

std::vector<double> soma_lengths_um(const CellGraph& cell) {
  const auto soma = std::find(cell.types.begin(), cell.types.end(), kSomaType);
  if (soma == cell.types.end()) return {};
  const auto first = static_cast<std::uint32_t>(soma - cell.types.begin());
  bool is_ordered = !cell.isGraph();
  for (std::uint32_t i = 0; is_ordered && i < cell.samples(); ++i)
    is_ordered = cell.parents[i] == kNoParent || cell.parents[i] < i;
  if (!is_ordered) {
    const CellPaths paths(cell);
    return paths.lengths_um(paths.at(first));
  }
  // One path leads from each sample to the first: up, then down.
  std::vector<double> lengths_um(cell.samples(), kNoSomaPath);
  lengths_um[first] = 0;
  for (std::uint32_t i = first; cell.parents[i] != kNoParent; i = cell.parents[i])
    lengths_um[cell.parents[i]] = lengths_um[i] + stepLength_um(cell, i, cell.parents[i]);
  for (std::uint32_t i = 0; i < cell.samples(); ++i)
    if (const std::uint32_t parent = cell.parents[i]; parent != kNoParent && lengths_um[i] == kNoSomaPath)
      lengths_um[i] = lengths_um[parent] + stepLength_um(cell, parent, i);
  return lengths_um;
}

void addPlaces(const TileStore& store, std::span<ContactSite> sites, std::uint64_t memory_bytes, unsigned threads,
               const std::function<void()>& check) {
  std::vector<SideOfSite> sides;
  sides.reserve(2 * sites.size());
  for (std::uint32_t i = 0; i < sites.size(); ++i)
    for (const std::uint32_t side : {0, 1}) sides.push_back({sites[i].sides[side].cell, 2 * i + side});
  std::sort(sides.begin(), sides.end(), [](const SideOfSite& a, const SideOfSite& b) {
    return std::tie(a.cell, a.site2) < std::tie(b.cell, b.site2);
  });
  std::vector<std::uint32_t> cells;
  std::vector<std::size_t> begins;
  for (std::size_t i = 0; i < sides.size(); ++i)
    if (i == 0 || sides[i - 1].cell != sides[i].cell) cells.push_back(sides[i].cell), begins.push_back(i);
  begins.push_back(sides.size());
  constexpr std::size_t kCellsAThread = 8;
  CellPass pass(store, cells, {.memory_bytes = memory_bytes, .threads = threads, .check = check});
  std::vector<CellGraph> graphs;
  for (std::size_t begin = 0; begin < cells.size(); begin += graphs.size()) {
    graphs.clear();
    while (graphs.size() < kCellsAThread * threads && begin + graphs.size() < cells.size())
      graphs.push_back(pass.next());
    runItems(graphs.size(), threads, [&](std::size_t i) {
      const std::vector<double> lengths_um = soma_lengths_um(graphs[i]);
      for (std::size_t s = begins[begin + i]; s < begins[begin + i + 1]; ++s)
        complete(sites[sides[s].site2 / 2].sides[sides[s].site2 % 2], graphs[i], lengths_um);
    });
  }
}

}  // namespace filiform::internal
