#include "index/cell/cell_parts.h"

#include "index/cell/soma.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

namespace filiform {

namespace {

// Sets of numbers; the lowest of a set stands for it.
class Groups {
 public:
  explicit Groups(std::size_t count) : first_(count) { std::iota(first_.begin(), first_.end(), 0U); }
  std::uint32_t of(std::uint32_t item) {
    while (first_[item] != item) item = first_[item] = first_[first_[item]];
    return item;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = of(a), b = of(b);
    first_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> first_;
};

struct SomaBall {
  Vector3d centre;
  double radius;  // 0: unknown
  std::uint32_t rank;
};

void joinTouching(std::vector<SomaBall> somata, Groups& groups) {
  double most = 0;
  for (const SomaBall& soma : somata) most = std::max(most, soma.radius);
  std::sort(somata.begin(), somata.end(), [](const auto& a, const auto& b) { return a.centre.x() < b.centre.x(); });
  for (std::size_t i = 0; i < somata.size(); ++i)
    for (std::size_t k = i + 1; k < somata.size(); ++k) {
      if (somata[k].centre.x() - somata[i].centre.x() > somata[i].radius + most) break;
      if ((somata[k].centre - somata[i].centre).norm() <= somata[i].radius + somata[k].radius)
        groups.join(somata[i].rank, somata[k].rank);
    }
}

}  // namespace

CellParts cellPartsOf(const Cell& whole) {
  CellParts result;
  if (!whole.isGraph() && std::count(whole.parents.begin(), whole.parents.end(), kNoParent) < 2) return result;
  const auto samples = static_cast<std::uint32_t>(whole.samples());
  std::vector<SomaBall> somata;
  for (std::uint32_t rank = 0; rank < samples; ++rank)
    if (whole.types[rank] == kSomaType) {
      const double radius = whole.radii_um[rank];
      somata.push_back({whole.positions_um[rank], radius > 0 && std::isfinite(radius) ? radius : 0, rank});
      if (somata.size() > kMostSamplesOfSomata) return result;
    }
  if (somata.size() < 2) return result;
  Groups trees(samples);
  for (std::uint32_t segment = 0; segment < whole.segmentRanks(); ++segment) {
    const auto [child, parent] = whole.ends(segment);
    trees.join(child, parent);
  }
  Groups groups = trees;
  joinTouching(std::move(somata), groups);
  std::vector<std::uint8_t> has(samples, 0);  // by the first sample of a group; 1: a soma, 2: a neurite
  for (std::uint32_t rank = 0; rank < samples; ++rank) has[groups.of(rank)] |= whole.types[rank] == kSomaType ? 1 : 2;
  const auto found = static_cast<std::uint32_t>(std::count(has.begin(), has.end(), 3));
  if (found < 2) return result;

  std::vector<std::uint32_t> parts(samples), places(samples);  // of each sample: its part, and its rank there
  std::vector<std::size_t> blocks(found + 1, 0);               // of each part: the id block of its last sample
  result.cells.resize(found + 1);
  std::size_t block = 0;
  for (std::uint32_t rank = 0, next = 0; rank < samples; ++rank) {
    const std::uint32_t first = groups.of(rank), part = has[first] != 3 ? found : first == rank ? next++ : parts[first];
    result.loose_trees += part == found && trees.of(rank) == rank ? 1 : 0;
    Cell& cell = result.cells[part];
    parts[rank] = part;
    places[rank] = static_cast<std::uint32_t>(cell.samples());
    if (block < whole.block_starts.size() && whole.block_starts[block] == rank) ++block;
    if (block != std::exchange(blocks[part], block) && cell.samples() > 0) cell.block_starts.push_back(places[rank]);
    cell.sample_ids.push_back(whole.sample_ids[rank]);
    cell.positions_um.push_back(whole.positions_um[rank]);
    cell.radii_um.push_back(whole.radii_um[rank]);
    cell.types.push_back(whole.types[rank]);
    if (const std::uint64_t line = whole.line(rank);
        line > 0 &&
        (cell.line_runs.empty() || line - cell.line_runs.back().line != places[rank] - cell.line_runs.back().rank))
      cell.line_runs.push_back({places[rank], line});
  }
  for (const OddRadius& odd : whole.odd_radii)
    result.cells[parts[odd.rank]].odd_radii.push_back({places[odd.rank], odd.radius_um});
  if (whole.isGraph()) {
    std::vector<std::vector<std::array<std::uint32_t, 2>>> links(found + 1);
    for (const auto& [child, parent] : whole.links)
      if (child != parent) links[parts[child]].push_back({places[child], places[parent]});
    for (std::uint32_t part = 0; part <= found; ++part) connect(result.cells[part], std::move(links[part]));
  } else {
    for (std::uint32_t rank = 0; rank < samples; ++rank) {
      const std::uint32_t parent = whole.parents[rank];
      result.cells[parts[rank]].parents.push_back(parent == kNoParent ? kNoParent : places[parent]);
    }
  }
  if (result.loose_trees == 0) result.cells.pop_back();
  const std::string name = whole.name.empty() ? cellNames({whole.source}).front() : whole.name;
  for (std::size_t part = 0; part < result.cells.size(); ++part)
    result.cells[part].name = name + "/" + (part == found ? "loose" : std::to_string(part + 1));
  return result;
}

}  // namespace filiform
