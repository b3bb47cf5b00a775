#include "index/levels/levels.h"

#include "index/errors.h"
#include "index/file/internal/digest.h"
#include "index/levels/internal/level_files.h"
#include "index/levels/internal/level_refinement.h"
#include "index/levels/internal/level_tree.h"
#include "index/tile/tile_codec.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

namespace filiform {

using internal::Bytes;
using internal::LevelRefinement;

namespace {

constexpr double kIsUnread = -1;  // instead of an error: the part stays, since the tiles below it are not read

}  // namespace

struct Levels::Impl {
  explicit Impl(const TileSet& s) : set(s) {}

  const TileSet& set;
  internal::LevelTable table;
  std::vector<std::string> packs;  // for messages
  std::unique_ptr<internal::LevelTree> tree;
  std::uint64_t bytes = 0;
  std::uint32_t long_segments = 0;  // of the long-segment tile

  bool isWhollyInView(const LevelPart& level, const LevelView& view) const;
  bool inView(const LevelPart& part, const LevelView& view) const;
  double errorOnScreen(const LevelPart& part, const LevelView& view) const;
  const GridBox& boxOf(const LevelPart& part) const {
    return part.level ? tree->box(part.tile) : set.entry(part.tile).content;
  }
  std::vector<LevelPart> seen(std::span<const LevelPart> parts, const LevelView& view) const;
  LevelChoice choose(const LevelView& view, std::uint64_t most_segments, double enough_px,
                     const LevelRefinement::Finer& finer) const;
  Bytes part(LevelId level, bool appearance, std::string& file, std::uint64_t& offset) const;
};

Levels::Levels(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Levels::~Levels() = default;

std::unique_ptr<Levels> Levels::open(const TileSet& set) {
  const SetFile* table_file = nullptr;
  auto impl = std::make_unique<Impl>(set);
  std::map<std::string, std::uint64_t> sizes;
  for (const SetFile& file : set.files()) {
    if (file.name == internal::kLevelsFile) table_file = &file;
    if (!file.name.starts_with("levels")) continue;
    sizes[file.name] = file.bytes;
    impl->bytes += file.bytes;
  }
  if (table_file == nullptr) return nullptr;
  const std::string name = set.describe(internal::kLevelsFile);
  for (bool again = false, read = false; !read; again = true) {
    const Bytes bytes = set.read(internal::kLevelsFile, 0, table_file->bytes);
    try {
      impl->table = internal::decodeLevels(bytes);
      read = true;
    } catch (const internal::Damage& damage) {
      if (again || !set.discard(internal::kLevelsFile, 0, bytes.size()))
        throw CorruptSet(name, damage.offset, damage.what);
    }
  }
  if (impl->table.grid.exponent() != set.grid().exponent()) throw CorruptSet(name, 0, "contradicts the manifest");
  for (const internal::TileLocation& at : impl->table.locations) {
    const std::string pack = internal::levelPackFile(at.pack);
    const auto found = sizes.find(pack);
    const std::uint64_t need = std::uint64_t{at.geometry_bytes} + at.appearance_bytes;
    if (found == sizes.end() || at.offset > found->second || need > found->second - at.offset)
      throw CorruptSet(name, 0, "a tile lies outside the packs");
    while (impl->packs.size() <= at.pack)
      impl->packs.push_back(set.describe(internal::levelPackFile(static_cast<std::uint32_t>(impl->packs.size()))));
  }
  if (set.long_tile() != kNoTile) impl->long_segments = set.entry(set.long_tile()).owned;
  impl->tree = std::make_unique<internal::LevelTree>(set, impl->table.entries);
  return std::unique_ptr<Levels>(new Levels(std::move(impl)));
}

LevelId Levels::size() const { return static_cast<LevelId>(impl_->table.entries.size()); }
const LevelEntry& Levels::entry(LevelId level) const { return impl_->table.entries.at(level); }
std::uint64_t Levels::bytes() const { return impl_->bytes; }

Bytes Levels::Impl::part(LevelId level, bool appearance, std::string& file, std::uint64_t& offset) const {
  const internal::TileLocation& at = table.locations.at(level);
  file = packs[at.pack];
  offset = at.offset + (appearance ? at.geometry_bytes : 0);
  const std::string pack = internal::levelPackFile(at.pack);
  for (bool again = false;; again = true) {
    Bytes read = set.read(pack, offset, appearance ? at.appearance_bytes : at.geometry_bytes);
    if (internal::checksum(read) == (appearance ? at.appearance_checksum : at.geometry_checksum)) return read;
    if (again || !set.discard(pack, offset, read.size()))
      throw CorruptTile(level, file, offset,
                        appearance ? "the checksum of a level's appearance is wrong" : "a level's checksum is wrong");
  }
}

std::shared_ptr<const Tile> Levels::load(LevelId level) const {
  std::string file;
  std::uint64_t offset = 0;
  const Bytes bytes = impl_->part(level, false, file, offset);
  const LevelEntry& stated = entry(level);
  const TilePlace place{level, stated.key, true, file.c_str(), offset};
  auto tile = std::make_shared<const Tile>(decodeTile(bytes, place, Grid(stated.exponent)));
  if (tile->segment_count() != stated.segments || tile->bytes() != stated.decoded_bytes)
    throw CorruptTile(level, file, offset, "contradicts the table of levels");
  if (tile->segment_count() > 0 && tile->segmentId(tile->segment_count() - 1).cell >= impl_->set.cell_count())
    throw CorruptTile(level, file, offset, "holds a segment of a cell that does not exist");
  return tile;
}

TileAppearance Levels::loadAppearance(LevelId level) const {
  if (entry(level).segments > internal::kMostOwnedUnread) load(level);
  std::string file;
  std::uint64_t offset = 0;
  const Bytes bytes = impl_->part(level, true, file, offset);
  return decodeAppearance(bytes, {level, entry(level).key, true, file.c_str(), offset}, entry(level).segments);
}

std::span<const LevelPart> Levels::below(LevelId level) const { return impl_->tree->below(level); }
bool Levels::knowsBelow(LevelId level) const { return impl_->tree->knowsBelow(level); }
LevelId Levels::above(const LevelPart& part) const { return impl_->tree->above(part); }

bool Levels::Impl::inView(const LevelPart& part, const LevelView& view) const {
  const GridBox& box = boxOf(part);
  if (box.empty()) return false;
  const Vector3d lo = set.grid().toWorld(box.lo), hi = set.grid().toWorld(box.hi);
  return std::all_of(view.planes.begin(), view.planes.end(), [&](const LevelView::Plane& plane) {
    const Vector3d farthest = (plane.n.array() >= 0).select(hi, lo);
    return plane.n.dot(farthest) >= plane.d;
  });
}

std::vector<LevelPart> Levels::Impl::seen(std::span<const LevelPart> parts, const LevelView& view) const {
  std::vector<LevelPart> in_view;
  for (LevelPart part : parts) {
    if (!inView(part, view)) continue;
    part.error_px = errorOnScreen(part, view);
    in_view.push_back(part);
  }
  return in_view;
}

bool Levels::Impl::isWhollyInView(const LevelPart& level, const LevelView& view) const {
  const GridBox& box = tree->box(level.tile);
  const Vector3d lo = set.grid().toWorld(box.lo), hi = set.grid().toWorld(box.hi);
  return std::all_of(view.planes.begin(), view.planes.end(), [&](const LevelView::Plane& plane) {
    const Vector3d nearest = (plane.n.array() >= 0).select(lo, hi);
    return plane.n.dot(nearest) >= plane.d;
  });
}

double Levels::Impl::errorOnScreen(const LevelPart& part, const LevelView& view) const {
  if (!part.level) return 0;
  const LevelEntry& e = table.entries[part.tile];
  // Never 0, so that 0 pixels ask for full resolution.
  const double error_um = std::max({e.error_um, e.pixel_um, set.grid().quantum_um() / 2});
  if (view.orthographic) return error_um * view.pixels_per_rad;
  const GridBox& box = tree->box(part.tile);
  const Vector3d lo = set.grid().toWorld(box.lo), hi = set.grid().toWorld(box.hi);
  const double distance = std::max((lo - view.eye_W).cwiseMax(view.eye_W - hi).cwiseMax(0.0).norm(), view.nearest_um);
  return distance > 0 ? error_um / distance * view.pixels_per_rad : std::numeric_limits<double>::infinity();
}

double Levels::errorOnScreen(LevelId level, const LevelView& view) const {
  return impl_->errorOnScreen({true, level, entry(level).segments, 0}, view);
}

LevelChoice Levels::Impl::choose(const LevelView& view, std::uint64_t most_segments, double enough_px,
                                 const LevelRefinement::Finer& finer) const {
  LevelChoice choice;
  std::vector<LevelPart> first = seen(tree->below(kRoots), view);
  if (const TileId tile = set.long_tile(); tile != kNoTile) first.push_back({false, tile, long_segments, 0});
  std::uint64_t segments = 0;
  for (const LevelPart& part : first) segments += part.segments;

  LevelRefinement chosen(std::move(first), segments, most_segments, finer);
  constexpr double kWave = 0.9;  // tiles of nearly the same error are replaced together
  while (chosen.worst() > enough_px) {
    const double worst = chosen.worst();
    if (std::isinf(worst)) {
      if (chosen.refine(std::numeric_limits<double>::max())) continue;
      chosen.refineAroundEye();
      choice.limited = true;
      continue;
    }
    if (chosen.refine(std::max(enough_px, kWave * worst))) continue;
    choice.limited = true;
    chosen.refineSingly(enough_px);
    break;
  }
  choice.parts = chosen.take();
  choice.segments = chosen.segments();
  for (LevelPart& part : choice.parts) {
    if (part.error_px == kIsUnread) {
      part.error_px = errorOnScreen(part, view);
      choice.unread.push_back(part.tile);
    }
    choice.error_px = std::max(choice.error_px, part.error_px);
    if (part.level) choice.hidden += table.entries[part.tile].hidden;
  }
  std::sort(choice.parts.begin(), choice.parts.end(), [](const LevelPart& a, const LevelPart& b) {
    if (a.error_px != b.error_px) return a.error_px > b.error_px;
    return a.level != b.level ? a.level : a.tile < b.tile;
  });
  return choice;
}

LevelChoice Levels::choose(const LevelView& view, std::uint64_t most_segments, double enough_px,
                           UnreadTiles unread) const {
  const internal::LevelTree& tree = *impl_->tree;
  const auto known = [&](const LevelPart& part) { return impl_->seen(tree.below(part.tile), view); };
  if (unread == UnreadTiles::read) return impl_->choose(view, most_segments, enough_px, known);
  if (!tree.knowsBelow(kRoots)) {
    LevelChoice choice;
    choice.unread.push_back(kRoots);
    return choice;
  }
  // First choose with a lower bound for the segments below an unread part: all of them if the whole part is in view,
  // else none. A part that exceeds the budget by this bound exceeds it once its tiles are known, so they need not be
  // read.
  LevelChoice hoped = impl_->choose(view, most_segments, enough_px, [&](const LevelPart& part) {
    if (tree.knowsBelow(part.tile)) return known(part);
    std::vector<LevelPart> parts = impl_->seen(tree.levelsBelow(part.tile), view);
    const std::uint32_t segments = impl_->isWhollyInView(part, view) ? tree.segmentsOfLeaves(part.tile) : 0;
    parts.push_back({true, part.tile, segments, kIsUnread});
    return parts;
  });
  if (hoped.unread.empty()) return hoped;
  LevelChoice choice = impl_->choose(view, most_segments, enough_px, [&](const LevelPart& part) {
    if (tree.knowsBelow(part.tile)) return known(part);
    return std::vector<LevelPart>{{true, part.tile, part.segments, kIsUnread}};
  });
  choice.unread = std::move(hoped.unread);
  return choice;
}

}  // namespace filiform
