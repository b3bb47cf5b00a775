#include "tools/serve/routes/doors/catmaid_nodes.h"

#include "index/tile/box_region.h"
#include "tools/serve/sets/limits.h"

#include <array>
#include <charconv>
#include <cmath>

namespace filiform::tools {

namespace {

void appendNumber(std::string& text, double value) {
  std::array<char, 32> digits{};
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}

}  // namespace

CatmaidNodes::CatmaidNodes(const ServedSet& served, const CatmaidSpace& space, const CatmaidSpace::Level& level,
                           const Box& box)
    : served_(served), space_(space), box_(box) {
  const Levels* const levels = served.levels();
  if (level.depth != CatmaidSpace::kFull && levels != nullptr) {
    for (const LevelPart& part : levels->below(Levels::kRoots)) addPart(part, level.depth);
    return;
  }
  const BoxRegion region({box_.lo_nm / 1e3, box_.hi_nm / 1e3});
  for (const auto& [tile, ignored] : served.finder().meeting(region)) addTile(tile);
  if (const TileId tile = served.store().long_tile(); tile != kNoTile) addTile(tile);
}

bool CatmaidNodes::meets(const GridBox& content, double quantum_nm) const {
  if (content.empty()) return false;
  return (content.lo.cast<double>().array() * quantum_nm < box_.hi_nm.array()).all() &&
         (content.hi.cast<double>().array() * quantum_nm >= box_.lo_nm.array()).all();
}

// Descends to the first tiles whose blocks are as deep as the level's.
void CatmaidNodes::addPart(const LevelPart& part, int depth) {
  if (truncated_) return;
  if (!part.level) {
    const double quantum_nm = served_.store().grid().quantum_um() * 1e3;
    if (meets(served_.store().entry(part.tile).content, quantum_nm)) addTile(part.tile);
    return;
  }
  const Levels& levels = *served_.levels();
  const LevelEntry& entry = levels.entry(part.tile);
  if (entry.key.depth >= depth && entry.coarser == 0) {
    if (meets(entry.content, Grid(entry.exponent).quantum_um() * 1e3)) addLevel(part.tile);
    return;
  }
  // Simplified neurites may leave their block a little, so that a block's box excludes nothing.
  for (const LevelPart& finer : levels.below(part.tile)) addPart(finer, depth);
}

void CatmaidNodes::addTile(TileId id) {
  if (truncated_) return;
  const auto tile = served_.store().load(id);
  addSegments({*tile, served_.store().loadAppearance(id), false, 0});
}

void CatmaidNodes::addLevel(LevelId level) {
  TimedStore::check();
  const auto tile = served_.levels()->load(level);
  addSegments({*tile, served_.levels()->loadAppearance(level), true, level});
}

std::size_t CatmaidNodes::place(std::int32_t id, const Vector3d& p_nm, std::uint32_t cell) {
  const auto [found, fresh] = places_.emplace(id, nodes_.size());
  if (fresh) nodes_.push_back({id, 0, p_nm, -1, CatmaidSpace::skeleton(cell)});
  return found->second;
}

void CatmaidNodes::addSegments(const Source& source) {
  const Tile& tile = source.tile;
  std::size_t owned = 0;
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    if (!tile.owned(s)) continue;
    const std::size_t at = owned++;
    const Tile::Link link = tile.link(s);
    const Vector3d child_nm = tile.position_W(link.child) * 1e3, parent_nm = tile.position_W(link.parent) * 1e3;
    const Vector3d middle_nm = (child_nm + parent_nm) / 2;
    if ((middle_nm.array() < box_.lo_nm.array()).any() || (middle_nm.array() >= box_.hi_nm.array()).any()) continue;
    if (nodes_.size() + 2 > limits::kDoorNodes) {
      truncated_ = true;
      return;
    }
    const auto idOf = [&](std::uint32_t node, const NodeId& sample) {
      return source.level ? space_.levelNode(source.id, node) : space_.node(sample.cell, sample.sample);
    };
    const std::size_t child = place(idOf(link.child, link.child_id), child_nm, link.id.cell);
    const float radius_um = at < source.appearance.radii_um.size() ? source.appearance.radii_um[at] : NAN;
    if (std::isfinite(radius_um)) nodes_[child].radius_nm = static_cast<double>(radius_um) * 1e3;
    if (link.child == link.parent) continue;
    const std::size_t parent = place(idOf(link.parent, link.parent_id), parent_nm, link.id.cell);
    if (nodes_[child].parent == 0) nodes_[child].parent = nodes_[parent].id;
  }
}

std::string CatmaidNodes::rows() const {
  std::string text;
  for (const Node& node : nodes_) {
    text += text.empty() ? "[" : ",\n[";
    text += std::to_string(node.id) + ',' + (node.parent == 0 ? "null" : std::to_string(node.parent));
    for (int axis = 0; axis < 3; ++axis) appendNumber(text += ',', node.p_nm[axis]);
    appendNumber(text += ",5,", node.radius_nm);
    text += ',' + std::to_string(node.skeleton) + ",0,1]";
  }
  return text;
}

}  // namespace filiform::tools
