#include "index/levels/internal/level_tree.h"

#include "index/geometry/partition.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace filiform::internal {

LevelTree::LevelTree(const TileSet& set, const std::vector<LevelEntry>& entries)
    : set_(set), entries_(entries), below_(entries.size() + 1), known_(entries.size() + 1) {
  std::vector<LevelId> inside;  // level tiles that contain the next one
  for (LevelId level = 0; level < entries.size(); ++level) {
    const LevelEntry& e = entries[level];
    while (!inside.empty() && entries[inside.back()].key.high() < e.key.low) inside.pop_back();
    above_.push_back(inside.empty() ? kLevelRoots : inside.back());
    below_[placeOf(above_.back())].push_back({true, level, e.segments, 0});
    inside.push_back(level);
    // Tiles below lie in the block; simplified neurites may leave it.
    GridBox& box = boxes_.emplace_back(closedBlock(e.key));
    box.lo = box.lo.cwiseMax(set.bounds().lo);
    box.hi = box.hi.cwiseMin(set.bounds().hi);
    if (!e.content.empty()) box.extend(e.content);
  }
}

std::size_t LevelTree::placeOf(LevelId level) const {
  if (level != kLevelRoots && level >= entries_.size()) throw std::out_of_range("the level tile does not exist");
  return level == kLevelRoots ? entries_.size() : level;
}

// The keys of full-resolution tiles directly below: those of the block between the level tiles inside.
std::vector<LevelTree::KeyRange> LevelTree::leavesBelow(std::size_t place) const {
  const bool is_root = place == entries_.size();
  if (is_root && !entries_.empty()) return {};  // the outermost block contains them all
  constexpr MortonKey kLast = (MortonKey{1} << kMortonBits) - 1;
  MortonKey next = is_root ? 0 : entries_[place].key.low;
  const MortonKey last = is_root ? kLast : entries_[place].key.high();
  std::vector<KeyRange> ranges;
  for (const LevelPart& part : below_[place]) {
    const BlockKey& block = entries_[part.tile].key;
    if (block.low > next) ranges.emplace_back(next, block.low - 1);
    next = block.high() + 1;
  }
  if (next <= last) ranges.emplace_back(next, last);
  return ranges;
}

std::vector<LevelPart> LevelTree::read(std::size_t place) const {
  std::vector<LevelPart> parts = below_[place];
  const std::vector<KeyRange> ranges = leavesBelow(place);
  for (const auto& [first, end] : set_.leavesWithin(ranges))
    for (TileId tile = first; tile < end; ++tile) parts.push_back({false, tile, set_.entry(tile).owned, 0});
  const auto low = [this](const LevelPart& part) {
    return part.level ? entries_[part.tile].key.low : set_.entry(part.tile).key.low;
  };
  std::sort(parts.begin(), parts.end(), [&](const LevelPart& a, const LevelPart& b) { return low(a) < low(b); });
  return parts;
}

std::span<const LevelPart> LevelTree::below(LevelId level) const {
  const std::size_t place = placeOf(level);
  return known_[place].get([&] { return std::make_unique<const std::vector<LevelPart>>(read(place)); });
}

bool LevelTree::knowsBelow(LevelId level) const {
  const std::size_t place = placeOf(level);
  return known_[place].known() != nullptr || leavesBelow(place).empty();
}

std::uint32_t LevelTree::segmentsOfLeaves(LevelId level) const {
  const auto all = [](const LevelEntry& e) { return e.represented + e.hidden; };
  std::uint64_t sum = all(entries_.at(level));
  for (const LevelPart& part : levelsBelow(level)) sum -= std::min(sum, all(entries_[part.tile]));
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(sum, UINT32_MAX));
}

LevelId LevelTree::above(const LevelPart& part) const {
  if (part.level) return above_.at(part.tile);
  if (entries_.empty() || part.tile == set_.long_tile()) return kLevelRoots;
  const MortonKey key = set_.entry(part.tile).key.low;
  const auto after = std::upper_bound(entries_.begin(), entries_.end(), key,
                                      [](MortonKey k, const LevelEntry& e) { return k < e.key.low; });
  LevelId level = after == entries_.begin() ? kLevelRoots : static_cast<LevelId>(after - entries_.begin()) - 1;
  while (level != kLevelRoots && entries_[level].key.high() < key) level = above_[level];
  return level;
}

}  // namespace filiform::internal
