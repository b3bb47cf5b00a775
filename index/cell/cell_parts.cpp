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

CellParts::CellParts(const Cell& whole) {
  const auto samples = static_cast<std::uint32_t>(whole.samples());
  std::vector<SomaBall> somata;
  for (std::uint32_t rank = 0; rank < samples; ++rank)
    if (whole.types[rank] == kSomaType) {
      const double radius = whole.radii_um[rank];
      somata.push_back({whole.positions_um[rank], radius > 0 && std::isfinite(radius) ? radius : 0, rank});
      if (somata.size() > kMostSomaSamples) return;
    }
  if (somata.size() < 2) return;
  Groups trees(samples);
  for (std::uint32_t segment = 0; segment < whole.segmentRanks(); ++segment) {
    const auto [child, parent] = whole.ends(segment);
    trees.join(child, parent);
  }
  Groups cells = trees;
  joinTouching(std::move(somata), cells);
  std::vector<std::uint8_t> has(samples, 0);  // by the first sample of a group; 1: a soma, 2: a neurite
  for (std::uint32_t rank = 0; rank < samples; ++rank) has[cells.of(rank)] |= whole.types[rank] == kSomaType ? 1 : 2;
  const auto found = static_cast<std::uint32_t>(std::count(has.begin(), has.end(), 3));
  if (found < 2) return;
  parts_.resize(samples);
  std::vector<std::size_t> sizes(found + 1, 0);
  for (std::uint32_t rank = 0, next = 0; rank < samples; ++rank) {
    const std::uint32_t first = cells.of(rank);
    parts_[rank] = has[first] != 3 ? found : first == rank ? next++ : parts_[first];
    ++sizes[parts_[rank]];
    loose_trees_ += parts_[rank] == found && trees.of(rank) == rank;
  }
  if (sizes.back() == 0) sizes.pop_back();
  starts_.assign(sizes.size() + 1, 0);
  std::inclusive_scan(sizes.begin(), sizes.end(), starts_.begin() + 1);
  ranks_.resize(samples);
  places_.resize(samples);
  std::vector<std::uint32_t> filled(sizes.size(), 0);
  for (std::uint32_t rank = 0; rank < samples; ++rank) {
    places_[rank] = filled[parts_[rank]]++;
    ranks_[starts_[parts_[rank]] + places_[rank]] = rank;
  }
}

Cell CellParts::take(const Cell& whole, std::size_t part) const {
  Cell cell;
  cell.source = whole.source;
  cell.digest = whole.digest;
  cell.header = whole.header;
  cell.attributes = whole.attributes;
  const bool loose = loose_trees_ > 0 && part + 1 == count();
  cell.name = (whole.name.empty() ? cellNames({whole.source}).front() : whole.name) + "/" +
              (loose ? "loose" : std::to_string(part + 1));
  const std::span ranks(ranks_.data() + starts_[part], starts_[part + 1] - starts_[part]);
  std::size_t block = 0;
  for (const std::uint32_t rank : ranks) {
    const auto in = static_cast<std::size_t>(
        std::upper_bound(whole.block_starts.begin(), whole.block_starts.end(), rank) - whole.block_starts.begin());
    if (in != block && cell.samples() > 0) cell.block_starts.push_back(places_[rank]);
    block = in;
    cell.sample_ids.push_back(whole.sample_ids[rank]);
    cell.positions_um.push_back(whole.positions_um[rank]);
    cell.radii_um.push_back(whole.radii_um[rank]);
    cell.types.push_back(whole.types[rank]);
    if (const std::uint64_t line = whole.line(rank);
        line > 0 &&
        (cell.line_runs.empty() || line - cell.line_runs.back().line != places_[rank] - cell.line_runs.back().rank))
      cell.line_runs.push_back({places_[rank], line});
    if (!whole.isGraph())
      cell.parents.push_back(whole.parents[rank] == kNoParent ? kNoParent : places_[whole.parents[rank]]);
  }
  for (OddRadius odd : whole.odd_radii)
    if (parts_[odd.rank] == part) {
      odd.rank = places_[odd.rank];
      cell.odd_radii.push_back(odd);
    }
  if (whole.isGraph()) {
    std::vector<std::array<std::uint32_t, 2>> edges;
    for (const auto& [child, parent] : whole.links)
      if (child != parent && parts_[child] == part) edges.push_back({places_[child], places_[parent]});
    connect(cell, std::move(edges));
  }
  return cell;
}

}  // namespace filiform
