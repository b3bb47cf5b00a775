#include "index/set/levels.h"

#include "index/errors.h"
#include "index/file/internal/digest.h"
#include "index/set/internal/level_files.h"
#include "index/tile/tile_codec.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <future>
#include <map>

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
  // From far away, the directory comes while the table of levels does.
  std::future<void> directory =
      std::async(set.isRemote() ? std::launch::async : std::launch::deferred, [&set] { set.readDirectory(); });
  Bytes bytes(table_file->bytes);
  const std::string name = set.describe(internal::kLevelsFile);
  for (bool again = false, read = false; !read; again = true) {
    set.read(internal::kLevelsFile, 0, bytes);
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
  directory.get();
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
  const std::string pack = internal::levelPackFile(at.pack);
  for (bool again = false;; again = true) {
    set.read(pack, offset, read);
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

double Levels::Impl::errorOnScreen(const LevelPart& part, const LevelView& view) const {
  if (!part.level) return 0;
  const LevelEntry& e = table.entries[part.tile];
  // Never 0, so that 0 pixels ask for full resolution.
  const double error_um = std::max({e.error_um, e.pixel_um, set.grid().quantum_um() / 2});
  if (view.orthographic) return error_um * view.pixels_per_rad;
  const GridBox& box = boxes[part.tile];
  const Vector3d lo = set.grid().toWorld(box.lo), hi = set.grid().toWorld(box.hi);
  const double distance = (lo - view.eye_W).cwiseMax(view.eye_W - hi).cwiseMax(0.0).norm();
  return distance > 0 ? error_um / distance * view.pixels_per_rad : std::numeric_limits<double>::infinity();
}

double Levels::errorOnScreen(LevelId level, const LevelView& view) const {
  return impl_->errorOnScreen({true, level, entry(level).segments, 0}, view);
}

namespace {

// Chosen parts, and replacing them by finer ones while the segments stay within a limit.
class Refinement {
 public:
  using Finer = std::function<std::vector<LevelPart>(const LevelPart&)>;
  Refinement(std::vector<LevelPart> parts, std::uint64_t segments, std::uint64_t most, Finer finer)
      : parts_(std::move(parts)), segments_(segments), most_(most), finer_(std::move(finer)) {}

  double worst() const {
    double worst = 0;
    for (const LevelPart& part : parts_) worst = std::max(worst, part.error_px);
    return worst;
  }
  // Replaces each part whose error exceeds `above_px`, until none is left. False: too many segments; nothing changed.
  bool refine(double above_px) {
    std::vector<LevelPart> left, open = parts_;
    std::uint64_t segments = segments_;
    while (!open.empty()) {
      const LevelPart part = open.back();
      open.pop_back();
      if (part.error_px <= above_px) {
        left.push_back(part);
        continue;
      }
      segments -= part.segments;
      for (const LevelPart& below : finer_(part)) {
        segments += below.segments;
        open.push_back(below);
      }
      if (segments > most_ + slackOf(open, above_px)) return false;
    }
    if (segments > most_) return false;
    parts_ = std::move(left);
    segments_ = segments;
    return true;
  }
  // Replaces the parts around the eye, coarsest first, each that fits. The others stay for good.
  void refineAroundEye() {
    std::vector<LevelPart> left, open;
    for (const LevelPart& part : parts_) (std::isinf(part.error_px) ? open : left).push_back(part);
    for (std::size_t i = 0; i < open.size(); ++i) {
      const LevelPart part = open[i];
      const std::vector<LevelPart> below = finer_(part);
      std::uint64_t sum = 0;
      for (const LevelPart& finer : below) sum += finer.segments;
      if (segments_ - part.segments + sum > most_) {
        settled_.push_back(part);
        continue;
      }
      segments_ += sum - part.segments;
      for (const LevelPart& finer : below) (std::isinf(finer.error_px) ? open : left).push_back(finer);
    }
    parts_ = std::move(left);
  }
  std::uint64_t segments() const { return segments_; }
  std::vector<LevelPart> take() {
    parts_.insert(parts_.end(), settled_.begin(), settled_.end());
    return std::move(parts_);
  }

 private:
  // Segments that further replacement may remove again.
  static std::uint64_t slackOf(const std::vector<LevelPart>& open, double above_px) {
    std::uint64_t sum = 0;
    for (const LevelPart& part : open)
      if (part.error_px > above_px) sum += part.segments;
    return sum;
  }

  std::vector<LevelPart> parts_, settled_;
  std::uint64_t segments_, most_;
  Finer finer_;
};

}  // namespace

LevelChoice Levels::choose(const LevelView& view, std::uint64_t most_segments, double enough_px) const {
  const auto seen = [&](std::span<const LevelPart> parts) {
    std::vector<LevelPart> in_view;
    for (LevelPart part : parts) {
      if (!impl_->inView(part, view)) continue;
      part.error_px = impl_->errorOnScreen(part, view);
      in_view.push_back(part);
    }
    return in_view;
  };
  std::vector<LevelPart> first = seen(below(kRoots));
  if (const TileId tile = impl_->set.long_tile(); tile != kNoTile)
    first.push_back({false, tile, impl_->set.entry(tile).owned, 0});
  std::uint64_t segments = 0;
  for (const LevelPart& part : first) segments += part.segments;

  Refinement chosen(std::move(first), segments, most_segments,
                    [&](const LevelPart& part) { return seen(below(part.tile)); });
  LevelChoice choice;
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
    break;
  }
  choice.parts = chosen.take();
  choice.segments = chosen.segments();
  for (const LevelPart& part : choice.parts) {
    choice.error_px = std::max(choice.error_px, part.error_px);
    if (part.level) choice.hidden += entry(part.tile).hidden;
  }
  std::sort(choice.parts.begin(), choice.parts.end(), [](const LevelPart& a, const LevelPart& b) {
    if (a.error_px != b.error_px) return a.error_px > b.error_px;
    return a.level != b.level ? a.level : a.tile < b.tile;
  });
  return choice;
}

}  // namespace filiform
