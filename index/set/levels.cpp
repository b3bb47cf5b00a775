#include "index/set/levels.h"

#include "index/errors.h"
#include "index/file/internal/digest.h"
#include "index/set/internal/level_files.h"
#include "index/tile/tile_codec.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>

namespace filiform {

using internal::Bytes;

struct Levels::Impl {
  explicit Impl(const TileSet& s) : set(s) {}

  const TileSet& set;
  internal::LevelTable table;
  std::vector<std::string> packs;       // for messages
  std::vector<LevelPart> parts;         // of each level tile, then the topmost
  std::vector<std::size_t> part_begin;  // by LevelId, then of the topmost, then the end
  std::vector<GridBox> boxes;  // by LevelId: box of all content below; simplified neurites may not reach all of it
  std::uint64_t bytes = 0;

  void link();
  bool inView(const LevelPart& part, const LevelView& view) const;
  double errorOnScreen(const LevelPart& part, const LevelView& view) const;
  const GridBox& boxOf(const LevelPart& part) const {
    return part.level ? boxes[part.tile] : set.entry(part.tile).content;
  }
  Bytes part(LevelId level, bool appearance, std::string& file, std::uint64_t& offset) const;
};

// Merges level tiles and leaves in key order; each goes under the innermost level tile that contains it.
void Levels::Impl::link() {
  std::vector<std::vector<LevelPart>> below(table.entries.size() + 1);
  std::vector<LevelId> inside;
  const auto closeUntil = [&](MortonKey low) {
    while (!inside.empty() && table.entries[inside.back()].key.high() < low) inside.pop_back();
  };
  const auto parent = [&] { return inside.empty() ? table.entries.size() : std::size_t{inside.back()}; };
  LevelId level = 0;
  const auto enterUntil = [&](MortonKey low, bool all) {
    for (; level < table.entries.size() && (all || table.entries[level].key.low <= low); ++level) {
      const LevelEntry& e = table.entries[level];
      closeUntil(e.key.low);
      below[parent()].push_back({true, level, e.segments, 0});
      inside.push_back(level);
    }
  };
  for (TileId tile = 0; tile < set.tile_count(); ++tile) {
    if (tile == set.long_tile()) continue;
    const TileEntry& e = set.entry(tile);
    enterUntil(e.key.low, false);
    closeUntil(e.key.low);
    below[parent()].push_back({false, tile, e.owned, 0});
  }
  enterUntil(0, true);
  part_begin.assign(1, 0);
  for (const std::vector<LevelPart>& some : below) {
    parts.insert(parts.end(), some.begin(), some.end());
    part_begin.push_back(parts.size());
  }
  boxes.resize(table.entries.size());
  for (std::size_t l = boxes.size(); l-- > 0;) {  // inner tiles have higher ids
    boxes[l] = table.entries[l].content;
    for (std::size_t i = part_begin[l]; i < part_begin[l + 1]; ++i)
      if (!boxOf(parts[i]).empty()) boxes[l].extend(boxOf(parts[i]));
  }
}

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
  Bytes bytes(table_file->bytes);
  set.read(internal::kLevelsFile, 0, bytes);
  const std::string name = set.describe(internal::kLevelsFile);
  try {
    impl->table = internal::decodeLevels(bytes);
  } catch (const internal::Damage& damage) {
    throw CorruptSet(name, damage.offset, damage.what);
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
  impl->link();
  return std::unique_ptr<Levels>(new Levels(std::move(impl)));
}

LevelId Levels::size() const { return static_cast<LevelId>(impl_->table.entries.size()); }
const LevelEntry& Levels::entry(LevelId level) const { return impl_->table.entries.at(level); }
std::uint64_t Levels::bytes() const { return impl_->bytes; }

Bytes Levels::Impl::part(LevelId level, bool appearance, std::string& file, std::uint64_t& offset) const {
  const internal::TileLocation& at = table.locations.at(level);
  file = packs[at.pack];
  offset = at.offset + (appearance ? at.geometry_bytes : 0);
  Bytes read(appearance ? at.appearance_bytes : at.geometry_bytes);
  set.read(internal::levelPackFile(at.pack), offset, read);
  if (internal::checksum(read) != (appearance ? at.appearance_checksum : at.geometry_checksum))
    throw CorruptTile(level, file, offset,
                      appearance ? "the checksum of a level's appearance is wrong" : "a level's checksum is wrong");
  return read;
}

std::shared_ptr<const Tile> Levels::load(LevelId level) const {
  std::string file;
  std::uint64_t offset = 0;
  const Bytes bytes = impl_->part(level, false, file, offset);
  const LevelEntry& stated = entry(level);
  const TilePlace place{level, stated.key, true, file.c_str(), offset};
  auto tile = std::make_shared<const Tile>(decodeTile(bytes, place, impl_->set.grid()));
  if (tile->segment_count() != stated.segments || tile->bytes() != stated.decoded_bytes)
    throw CorruptTile(level, file, offset, "contradicts the table of levels");
  return tile;
}

TileAppearance Levels::loadAppearance(LevelId level) const {
  std::string file;
  std::uint64_t offset = 0;
  const Bytes bytes = impl_->part(level, true, file, offset);
  return decodeAppearance(bytes, {level, entry(level).key, true, file.c_str(), offset}, entry(level).segments);
}

std::span<const LevelPart> Levels::below(LevelId level) const {
  const std::size_t at = level == kRoots ? size() : level;
  return {impl_->parts.data() + impl_->part_begin.at(at), impl_->parts.data() + impl_->part_begin.at(at + 1)};
}

bool Levels::Impl::inView(const LevelPart& part, const LevelView& view) const {
  const GridBox& box = boxOf(part);
  if (box.empty()) return false;
  const Vector3d lo = set.grid().toWorld(box.lo), hi = set.grid().toWorld(box.hi);
  return std::all_of(view.planes.begin(), view.planes.end(), [&](const LevelView::Plane& plane) {
    const Vector3d farthest = (plane.n.array() >= 0).select(hi, lo);
    return plane.n.dot(farthest) >= plane.d;
  });
}

// Dropped segments count by their share: if all are dropped, the error is that of the block's size.
double Levels::Impl::errorOnScreen(const LevelPart& part, const LevelView& view) const {
  if (!part.level) return 0;
  const LevelEntry& e = table.entries[part.tile];
  const GridBox& box = boxes[part.tile];
  const Vector3d lo = set.grid().toWorld(box.lo), hi = set.grid().toWorld(box.hi);
  const double share =
      static_cast<double>(e.dropped) / static_cast<double>(std::max<std::uint64_t>(1, e.dropped + e.represented));
  constexpr double kPartOfEdge = 64;
  const double error_um = std::max(e.error_um, share * (hi - lo).maxCoeff() / kPartOfEdge);
  if (view.orthographic) return error_um * view.pixels_per_rad;
  const double distance = (lo - view.eye_W).cwiseMax(view.eye_W - hi).cwiseMax(0.0).norm();
  return distance > 0 ? error_um / distance * view.pixels_per_rad : std::numeric_limits<double>::infinity();
}

double Levels::errorOnScreen(LevelId level, const LevelView& view) const {
  return impl_->errorOnScreen({true, level, entry(level).segments, 0}, view);
}

LevelChoice Levels::choose(const LevelView& view, std::uint64_t most_segments, double enough_px) const {
  const auto finer = [](const LevelPart& a, const LevelPart& b) {
    if (a.error_px != b.error_px) return a.error_px < b.error_px;
    return a.level != b.level ? b.level : a.tile > b.tile;
  };
  std::priority_queue<LevelPart, std::vector<LevelPart>, decltype(finer)> open(finer);
  LevelChoice choice;
  const auto seen = [&](std::span<const LevelPart> parts) {
    std::vector<LevelPart> in_view;
    for (LevelPart part : parts) {
      if (!impl_->inView(part, view)) continue;
      part.error_px = impl_->errorOnScreen(part, view);
      in_view.push_back(part);
    }
    return in_view;
  };
  const auto keep = [&](const LevelPart& part) {
    choice.error_px = std::max(choice.error_px, part.error_px);
    if (part.level) choice.dropped += entry(part.tile).dropped;
    choice.parts.push_back(part);
  };
  if (const TileId tile = impl_->set.long_tile(); tile != kNoTile) {
    const LevelPart part{false, tile, impl_->set.entry(tile).owned, 0};
    choice.segments += part.segments;
    keep(part);
  }
  for (const LevelPart& part : seen(below(kRoots))) {
    choice.segments += part.segments;
    open.push(part);
  }
  while (!open.empty()) {
    const LevelPart worst = open.top();
    open.pop();
    if (!worst.level || worst.error_px <= enough_px) {
      keep(worst);
      continue;
    }
    const std::vector<LevelPart> finer_parts = seen(below(worst.tile));
    std::uint64_t sum = 0;
    for (const LevelPart& part : finer_parts) sum += part.segments;
    if (choice.segments - worst.segments + sum > most_segments) {
      keep(worst);  // other tiles with smaller errors may still fit
      continue;
    }
    choice.segments += sum - worst.segments;
    for (const LevelPart& part : finer_parts) open.push(part);
  }
  std::stable_sort(choice.parts.begin(), choice.parts.end(),
                   [&](const LevelPart& a, const LevelPart& b) { return finer(b, a); });
  return choice;
}

std::vector<std::string> checkLevels(const TileSet& set, const Levels& levels) {
  std::vector<std::string> problems;
  const Grid grid = set.grid();
  struct Piece {
    Vector3d a_W, b_W;
  };
  struct Open {  // a level tile that contains the current leaf
    LevelId level;
    MortonKey high;
    std::vector<std::pair<std::uint32_t, Piece>> pieces;  // of neurites, by cell
    std::uint64_t owned = 0, far = 0;
  };
  std::vector<Open> inside;
  const auto finish = [&](const Open& open) {
    const LevelEntry& e = levels.entry(open.level);
    const std::string what = "level tile " + std::to_string(open.level) + ": ";
    if (open.owned != e.represented + e.dropped)
      problems.push_back(what + "represents " + std::to_string(e.represented) + " and drops " +
                         std::to_string(e.dropped) + " segments, but there are " + std::to_string(open.owned));
    if (open.far > e.dropped)
      problems.push_back(what + std::to_string(open.far) + " segments lie farther than its error, but only " +
                         std::to_string(e.dropped) + " are stated as dropped");
  };
  LevelId level = 0;
  for (TileId id = 0; id < set.tile_count(); ++id) {
    if (id == set.long_tile()) continue;
    const MortonKey low = set.entry(id).key.low;
    while (!inside.empty() && inside.back().high < low) {
      finish(inside.back());
      inside.pop_back();
    }
    for (; level < levels.size() && levels.entry(level).key.low <= low; ++level) {
      if (levels.entry(level).key.high() < low) {
        problems.push_back("level tile " + std::to_string(level) + ": it contains no tile");
        continue;
      }
      Open open{level, levels.entry(level).key.high(), {}, 0, 0};
      const std::shared_ptr<const Tile> tile = levels.load(level);
      if (levels.loadAppearance(level).types.size() != tile->segment_count())
        problems.push_back("level tile " + std::to_string(level) + ": its appearance has the wrong length");
      for (std::uint32_t s = 0; s < tile->segment_count(); ++s)
        open.pieces.emplace_back(tile->segmentId(s).cell,
                                 Piece{tile->position_W(tile->child(s)), tile->position_W(tile->parent(s))});
      inside.push_back(std::move(open));
    }
    const std::shared_ptr<const Tile> tile = set.load(id);
    for (Open& open : inside) {
      // Tolerance for rounding of the distances below, also far from the origin.
      const double error = levels.entry(open.level).error_um * (1 + 1e-9) + grid.quantum_um() * 1e-3;
      const double error2 = error * error;
      for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
        if (!tile->owned(s)) continue;
        ++open.owned;
        const std::uint32_t cell = tile->segmentId(s).cell;
        const auto first = std::lower_bound(open.pieces.begin(), open.pieces.end(), cell,
                                            [](const auto& piece, std::uint32_t of) { return piece.first < of; });
        const auto last =
            std::find_if(first, open.pieces.end(), [&](const auto& piece) { return piece.first != cell; });
        const Vector3d ends_W[] = {tile->position_W(tile->child(s)), tile->position_W(tile->parent(s))};
        for (const Vector3d& p_W : {ends_W[0], ends_W[1], Vector3d(0.5 * (ends_W[0] + ends_W[1]))}) {
          const bool near = std::any_of(first, last, [&](const auto& piece) {
            const Vector3d way = piece.second.b_W - piece.second.a_W, d = p_W - piece.second.a_W;
            const double squared = way.squaredNorm();
            const double t = squared > 0 ? std::clamp(d.dot(way) / squared, 0.0, 1.0) : 0.0;
            return (d - t * way).squaredNorm() <= error2;
          });
          if (near) continue;
          ++open.far;
          break;
        }
      }
    }
  }
  for (; !inside.empty(); inside.pop_back()) finish(inside.back());
  if (level != levels.size()) problems.push_back("a level tile contains no tiles");
  return problems;
}

}  // namespace filiform
