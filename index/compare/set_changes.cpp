#include "index/compare/set_changes.h"

#include "index/query/cell_pass.h"

#include <utility>
#include <vector>

namespace filiform {
namespace {

struct CellPair {
  std::optional<std::uint32_t> a, b;
};

// A name belongs to one cell of a set at most.
std::vector<CellPair> pairsOf(const TileStore& a, const TileStore& b) {
  std::vector<CellPair> pairs;
  for (std::uint32_t i = 0; i < a.cell_count(); ++i)
    if (!a.cell(i).removed) pairs.push_back({i, b.findCell(a.cell(i).name)});
  for (std::uint32_t i = 0; i < b.cell_count(); ++i)
    if (!b.cell(i).removed && !a.findCell(b.cell(i).name)) pairs.push_back({std::nullopt, i});
  return pairs;
}

void describeCell(const CellGraph& cell, std::size_t i, CellDifference& difference) {
  difference.names[i] = cell.name;
  difference.samples[i] = cell.samples();
  difference.length_um[i] = lengthOf_um(cell);
}

std::optional<std::array<TraceDistance, 2>> distancesOf(const CellGraph& a, const CellGraph& b,
                                                        const TraceDistanceOptions& options) {
  if (a.samples() == 0 || b.samples() == 0) return std::nullopt;
  return std::array{traceDistance(a, b, options), traceDistance(b, a, options)};
}

}  // namespace

CellDifference differenceOf(const CellGraph& a, const CellGraph& b, const TraceDistanceOptions* measuring) {
  CellDifference difference;
  describeCell(a, 0, difference);
  describeCell(b, 1, difference);
  difference.change = compareCells(a, b);
  if (measuring != nullptr) difference.distance = distancesOf(a, b, *measuring);
  return difference;
}

std::uint64_t cellsOfBoth(const TileStore& a, const TileStore& b) { return pairsOf(a, b).size(); }

void compareSets(const TileStore& a, const TileStore& b, const SetChangesOptions& options,
                 const std::function<void(const CellDifference&)>& visit) {
  const std::vector<CellPair> pairs = pairsOf(a, b);
  std::array<std::vector<std::uint32_t>, 2> ids;
  for (const CellPair& pair : pairs) {
    if (pair.a) ids[0].push_back(*pair.a);
    if (pair.b) ids[1].push_back(*pair.b);
  }
  std::uint64_t done = 0;
  const auto check = [&] {
    if (options.check) options.check(done);
  };
  const CellPassOptions passing{.memory_bytes = options.memory_bytes / 2, .threads = options.threads, .check = check};
  CellPass cells_a(a, std::move(ids[0]), passing), cells_b(b, std::move(ids[1]), passing);
  for (const CellPair& pair : pairs) {
    const CellGraph one = pair.a ? cells_a.next() : CellGraph(), other = pair.b ? cells_b.next() : CellGraph();
    CellDifference difference;
    if (pair.a && pair.b) {
      difference = differenceOf(one, other, nullptr);
      if (options.within_um > 0 && difference.change.kind == CellFate::kChanged)
        difference.distance = distancesOf(one, other, {.within_um = options.within_um, .check = check});
    } else {
      describeCell(pair.a ? one : other, pair.a ? 0 : 1, difference);
      difference.change.kind = pair.a ? CellFate::kRemoved : CellFate::kAdded;
    }
    check();
    visit(difference);
    ++done;
  }
}

}  // namespace filiform
