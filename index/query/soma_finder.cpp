#include "index/query/soma_finder.h"

#include "index/geometry/partition.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <iterator>
#include <optional>

namespace filiform {

namespace {

// The segment of which the node is the child; nullopt for a root.
std::optional<std::uint32_t> ownSegment(const Tile& tile, std::uint32_t node) {
  for (const std::uint32_t segment : tile.incident(node))
    if (tile.child(segment) == node && !tile.isolated(segment)) return segment;
  return std::nullopt;
}

}  // namespace

void SomaFinder::offer(std::shared_ptr<const Tile> tile, TileAppearance appearance) {
  for (const auto& held : held_)
    if (held && held->tile->id() == tile->id()) return;
  held_[next_] = std::make_shared<const Held>(Held{std::move(tile), std::move(appearance)});
  next_ = (next_ + 1) % kMostHeld;
}

void SomaFinder::offer(std::uint32_t cell, const CellDetail& detail) {
  if (roots_.size() > kMostCells) roots_.clear();
  std::vector<CellDetail::Root>& roots = roots_[cell];
  roots.clear();
  std::copy_if(detail.roots.begin(), detail.roots.end(), std::back_inserter(roots),
               [](const CellDetail::Root& root) { return root.type == kSomaType; });
}

std::shared_ptr<const SomaFinder::Held> SomaFinder::hold(TileId tile) {
  for (const auto& held : held_)
    if (held && held->tile->id() == tile) return held;
  TileAppearance appearance = store_.loadAppearance(tile);
  offer(store_.load(tile), std::move(appearance));
  return held_[(next_ + kMostHeld - 1) % kMostHeld];
}

SomaFinder::Look SomaFinder::lookOf(const Held& held, std::uint32_t segment) {
  const auto lookIn = [](const Held& owner, std::uint32_t s) {
    const std::uint32_t at = owner.tile->ownedIndex(s);
    return Look{owner.appearance.radii_um[at], owner.appearance.types[at]};
  };
  const Tile& tile = *held.tile;
  if (tile.owned(segment)) return lookIn(held, segment);
  const Tile::Link link = tile.link(segment);
  for (const TileId id :
       {store_.home(midpoint(tile.gridPoint(link.child), tile.gridPoint(link.parent))), store_.long_tile()}) {
    if (id == kNoTile) continue;
    const std::shared_ptr<const Held> owner = hold(id);
    const std::optional<std::uint32_t> found = owner->tile->findSegment(link.id);
    if (found && owner->tile->owned(*found)) return lookIn(*owner, *found);
  }
  return {};
}

SomaFinder::Place SomaFinder::homeOf(NodeId sample, const GridPoint& at) {
  const TileId home = store_.home(at);
  if (home == kNoTile) return {};
  const std::shared_ptr<const Held> held = hold(home);
  const std::optional<std::uint32_t> node = held->tile->findNode(sample);
  return node ? Place{held, *node} : Place{};
}

const std::vector<CellDetail::Root>& SomaFinder::rootsOf(std::uint32_t cell) {
  const auto known = roots_.find(cell);
  if (known != roots_.end()) return known->second;
  offer(cell, store_.loadCellDetail(cell));
  return roots_[cell];
}

std::shared_ptr<const Soma> SomaFinder::read(const CellDetail::Root& root, NodeId sample, const GridPoint& at) {
  const Grid grid = store_.grid();
  std::vector<SomaSample> samples = {{sample.sample, 0, grid.toWorld(at), root.radius_um, false}};
  std::vector<GridPoint> points = {at};
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    const Place place = homeOf({sample.cell, samples[i].rank}, points[i]);
    if (place.held == nullptr) return nullptr;
    const Tile& tile = *place.held->tile;
    for (const std::uint32_t segment : tile.incident(place.node)) {
      const std::uint32_t child = tile.child(segment);
      if (child == place.node) continue;
      const Look look = lookOf(*place.held, segment);
      if (look.type != kSomaType) {
        samples[i].has_neurite = true;
        continue;
      }
      if (samples.size() > kMostSomaSamples) return nullptr;
      const GridPoint p = tile.gridPoint(child);
      samples.push_back({tile.nodeId(child).sample, i, grid.toWorld(p), look.radius_um, false});
      points.push_back(p);
    }
  }
  std::optional<Soma> soma = somaOf(samples, grid.quantum_um() * std::sqrt(3.0) / 2);
  return soma ? std::make_shared<const Soma>(std::move(*soma)) : nullptr;
}

std::shared_ptr<const Soma> SomaFinder::of(NodeId sample, const GridPoint& at) {
  if (hasLoops(store_.cell(sample.cell))) return nullptr;
  std::vector<NodeId> passed;
  std::shared_ptr<const Soma> soma;
  NodeId now = sample;
  GridPoint point = at;
  while (passed.size() <= kMostSomaSamples) {
    const auto known = known_.find(now.key());
    if (known != known_.end()) {
      soma = known->second;
      break;
    }
    const Place place = homeOf(now, point);
    if (place.held == nullptr) break;
    const Tile& tile = *place.held->tile;
    const std::optional<std::uint32_t> own = ownSegment(tile, place.node);
    if (!own) {
      const std::vector<CellDetail::Root>& roots = rootsOf(now.cell);
      const auto root =
          std::find_if(roots.begin(), roots.end(), [&](const CellDetail::Root& r) { return r.rank == now.sample; });
      if (root == roots.end()) break;
      passed.push_back(now);
      soma = read(*root, now, point);
      break;
    }
    if (lookOf(*place.held, *own).type != kSomaType) break;
    passed.push_back(now);
    const std::uint32_t parent = tile.parent(*own);
    now = tile.nodeId(parent);
    point = tile.gridPoint(parent);
  }
  for (const NodeId& node : passed) known_[node.key()] = soma;
  return soma;
}

std::shared_ptr<const Soma> SomaFinder::ofIfReadable(NodeId sample, const GridPoint& at) noexcept {
  try {
    return of(sample, at);
  } catch (const std::exception&) {
    return nullptr;
  }
}

std::shared_ptr<const Soma> SomaFinder::atIfReadable(std::uint32_t cell, const GridPoint& at) noexcept {
  try {
    const TileId home = store_.home(at);
    if (home == kNoTile) return nullptr;
    const std::shared_ptr<const Tile> tile = hold(home)->tile;
    for (std::uint32_t node = 0; node < tile->node_count(); ++node) {
      if (tile->nodeId(node).cell != cell || tile->gridPoint(node) != at) continue;
      if (std::shared_ptr<const Soma> soma = of(tile->nodeId(node), at)) return soma;
    }
  } catch (const std::exception&) {
  }
  return nullptr;
}

}  // namespace filiform
