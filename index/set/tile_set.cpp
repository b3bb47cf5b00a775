#include "index/set/tile_set.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/file/internal/digest.h"
#include "index/file/internal/read_once.h"
#include "index/file/internal/set_files.h"
#include "index/remote/http_source.h"
#include "index/remote/internal/http_errors.h"
#include "index/set/internal/cells_reader.h"
#include "index/set/internal/directory_reader.h"
#include "index/set/internal/landmarks_file.h"
#include "index/set/internal/patches_file.h"
#include "index/set/internal/revision.h"
#include "index/set/reads_at_once.h"
#include "index/tile/internal/merged_tile.h"
#include "index/tile/tile_codec.h"
#include "index/workers.h"

#include <algorithm>
#include <atomic>
#include <set>
#include <string_view>

namespace filiform {

using internal::Bytes;
using internal::decoded;

struct TileSet::Impl {
  internal::Revision revision;
  internal::DirectoryReader directory;
  internal::CellsReader cells;
  mutable internal::ReadOnce<Landmarks> landmarks;
  mutable internal::ReadOnce<UsualBox> usual;  // if the manifest does not state it
  mutable internal::ReadOnce<std::vector<internal::Patch>> patches;

  Impl(std::unique_ptr<TileSource> source, const std::string& wanted)
      : revision(std::move(source), wanted), directory(revision), cells(revision) {}

  const internal::Manifest& manifest() const { return revision.manifest(); }
  // A tile, or the patch of a tile.
  Bytes part(TileId tile, const internal::TileLocation& at, bool appearance) const;
  TilePlace placeOf(TileId tile, const internal::TileLocation& at, bool appearance) const;
  Tile decodedTile(TileId tile, const internal::TileLocation& at) const {
    const Bytes bytes = part(tile, at, false);
    return decodeTile(bytes, placeOf(tile, at, false), manifest().grid);
  }
  TileAppearance decodedAppearance(TileId tile, const internal::TileLocation& at, std::uint32_t owned) const {
    const Bytes bytes = part(tile, at, true);
    return decodeAppearance(bytes, placeOf(tile, at, true), owned);
  }
  const internal::Patch* patch(TileId tile) const;
};

const internal::Patch* TileSet::Impl::patch(TileId tile) const {
  const SetFile* const file = revision.find(internal::kPatchesFile);
  if (file == nullptr) return nullptr;
  const std::vector<internal::Patch>& all = patches.get([&] {
    const Bytes bytes = revision.readChecked(file->name, 0, file->bytes, file->digest, "the file");
    auto found = std::make_unique<std::vector<internal::Patch>>(
        decoded(revision.describe(file->name), 0, [&] { return internal::decodePatches(bytes); }));
    for (const internal::Patch& p : *found) directory.checkLocation(p.tile, p.at);
    return found;
  });
  const auto at =
      std::lower_bound(all.begin(), all.end(), tile, [](const internal::Patch& p, TileId t) { return p.tile < t; });
  return at != all.end() && at->tile == tile ? &*at : nullptr;
}

TilePlace TileSet::Impl::placeOf(TileId tile, const internal::TileLocation& at, bool appearance) const {
  return {tile, directory.entry(tile).key, tile == directory.root().long_tile, directory.packName(at.pack).c_str(),
          at.offset + (appearance ? at.geometry_bytes : 0)};
}

Bytes TileSet::Impl::part(TileId tile, const internal::TileLocation& at, bool appearance) const {
  const TilePlace place = placeOf(tile, at, appearance);
  const std::string file = internal::packFile(at.pack);
  const std::uint32_t size = appearance ? at.appearance_bytes : at.geometry_bytes;
  for (bool again = false;; again = true) {
    Bytes bytes = revision.read(file, place.offset, size);
    if (internal::checksum(bytes) == (appearance ? at.appearance_checksum : at.geometry_checksum)) return bytes;
    if (again || !revision.discard(file, place.offset, size))
      throw CorruptTile(tile, place.file, place.offset,
                        appearance ? "the appearance's checksum is wrong" : "its checksum is wrong");
  }
}

TileSet::TileSet(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TileSet::~TileSet() = default;

std::unique_ptr<TileSet> TileSet::open(const std::string& name, const RemoteOptions& remote,
                                       const std::string& revision) {
  // A new revision may be published between reading CURRENT and opening the first file: then start again.
  const bool is_address = isAddress(name);
  for (int attempt = 0;; ++attempt) {
    try {
      return open(openSource(name, remote), revision);
    } catch (const internal::NotOnServer&) {
      if (attempt == 2) throw;
    } catch (const IoError&) {
      if (attempt == 2 || is_address) throw;
    }
  }
}

std::unique_ptr<TileSet> TileSet::open(std::unique_ptr<TileSource> source, const std::string& revision) {
  return std::unique_ptr<TileSet>(new TileSet(std::make_unique<Impl>(std::move(source), revision)));
}

Grid TileSet::grid() const { return impl_->manifest().grid; }
const LeafIndex& TileSet::leaves() const { return impl_->directory.leaves(); }
TileId TileSet::home(const GridPoint& p) const { return impl_->directory.home(p); }
TileId TileSet::tile_count() const { return impl_->directory.root().tiles; }
TileId TileSet::long_tile() const { return impl_->directory.root().long_tile; }
const TileEntry& TileSet::entry(TileId tile) const { return impl_->directory.entry(tile); }
TileId TileSet::page_tiles() const { return impl_->directory.root().page_tiles; }
std::uint32_t TileSet::group_pages() const { return impl_->directory.root().group_pages; }
GridBox TileSet::pageContent(std::uint32_t page) const { return impl_->directory.record(page).content; }
GridBox TileSet::groupContent(std::uint32_t group) const { return impl_->directory.root().groups.at(group).content; }
std::vector<GridBox> TileSet::pageBoxes(std::uint32_t page) const { return impl_->directory.record(page).boxes; }
std::vector<GridBox> TileSet::groupBoxes(std::uint32_t group) const {
  return impl_->directory.root().groups.at(group).boxes;
}
std::uint64_t TileSet::floorBytes() const { return impl_->manifest().floor_bytes; }
std::uint64_t TileSet::segmentCount() const { return counts().segments; }
std::uint64_t TileSet::decodedBytes() const { return counts().decoded_bytes; }
UsualBox TileSet::usualBox() const {
  if (const std::optional<UsualBox>& stated = impl_->manifest().usual) return *stated;
  return impl_->usual.get([this] {
    readDirectory();
    return std::make_unique<const UsualBox>(TileStore::usualBox());
  });
}
bool TileSet::isRemote() const { return impl_->revision.isRemote(); }
std::optional<RemoteCounters> TileSet::remoteCounters() const { return impl_->revision.remoteCounters(); }

std::vector<std::pair<TileId, TileId>> TileSet::leavesWithin(
    std::span<const std::pair<MortonKey, MortonKey>> ranges) const {
  const auto readAll = [&](const std::set<std::size_t>& numbers, const auto& read) {
    const std::vector<std::size_t> all(numbers.begin(), numbers.end());
    std::atomic<std::size_t> next{0};
    runWorkers(std::min<std::size_t>(all.size(), readsAtOnce(*this)), [&](unsigned, const std::atomic<bool>& failed) {
      for (std::size_t i = 0; !failed && (i = next.fetch_add(1)) < all.size();) read(all[i]);
    });
  };
  const auto& directory = impl_->directory;
  std::set<std::size_t> groups, pages;
  const auto add = [](std::set<std::size_t>& numbers, std::size_t first, std::size_t last) {
    if (last == LeafIndex::kNone) return;  // the range ends before the first tile
    for (std::size_t n = first == LeafIndex::kNone ? 0 : first; n <= last; ++n) numbers.insert(n);
  };
  for (const auto& [first, last] : ranges) add(groups, leaves().groupOf(first), leaves().groupOf(last));
  readAll(groups, [&](std::size_t group) { directory.knowGroup(static_cast<std::uint32_t>(group)); });
  for (const auto& [first, last] : ranges) add(pages, leaves().pageOf(first), leaves().pageOf(last));
  readAll(pages, [&](std::size_t page) { directory.knowPage(static_cast<TileId>(page) * page_tiles()); });
  std::vector<std::pair<TileId, TileId>> found;
  for (const auto& [first, last] : ranges) found.emplace_back(leaves().firstFrom(first), leaves().firstFrom(last + 1));
  return found;
}

void TileSet::readDirectory() const {
  const std::uint64_t pages = impl_->directory.root().page_count(), readers = readsAtOnce(*this);
  // Each reader takes neighbouring pages, which come with one read.
  runWorkers(readers, [&](std::uint64_t reader, const std::atomic<bool>& failed) {
    for (std::uint64_t page = reader * pages / readers; page < (reader + 1) * pages / readers && !failed; ++page)
      entry(impl_->directory.root().pageBegin(static_cast<std::uint32_t>(page)));
  });
}

void TileSet::checkDirectory() const {
  readDirectory();
  SetCounts sum = counts();
  sum.stored_segments = sum.decoded_bytes = 0;
  std::uint64_t owned = 0;
  TileFloor floor;
  for (TileId tile = 0; tile < tile_count(); ++tile) {
    const TileEntry& e = entry(tile);
    sum.stored_segments += e.stored;
    sum.decoded_bytes += e.decoded_bytes;
    owned += e.owned;
    floor.add(e.decoded_bytes, tile == long_tile());
  }
  if (sum != counts() || owned != counts().segments + counts().isolated || floor.bytes() != floorBytes())
    throw CorruptSet(describe(internal::kDirectoryFile), 0, "contradicts the manifest");
}
void TileSet::checkCells() const { impl_->cells.check(); }
std::uint32_t TileSet::capacity() const { return impl_->manifest().capacity; }

std::shared_ptr<const Tile> TileSet::load(TileId tile) const {
  auto loaded = loadToSearch(tile);
  impl_->directory.knowHomes(*loaded);
  return loaded;
}

std::shared_ptr<const Tile> TileSet::loadToSearch(TileId tile) const {
  const TileEntry& stated = entry(tile);
  const internal::Patch* const patch = impl_->patch(tile);
  const internal::TileLocation& at = location(tile);
  const auto refuse = [&](const internal::TileLocation& where, const char* why = "contradicts the directory") {
    const TilePlace place = impl_->placeOf(tile, where, false);
    throw CorruptTile(tile, place.file, place.offset, why);
  };
  Tile found = impl_->decodedTile(tile, at);
  if (patch != nullptr) {
    const Tile added = impl_->decodedTile(tile, patch->at);
    if (found.segment_count() != patch->stored || found.owned_count() != patch->owned || found.segment_count() == 0 ||
        added.segment_count() == 0 || found.segmentId(found.segment_count() - 1).cell >= added.segmentId(0).cell)
      refuse(patch->at);
    found = Tile(found, added);
    if (found.bytes() > stated.decoded_bytes) refuse(patch->at);
    found.countAs(stated.decoded_bytes);
  }
  if (found.segment_count() != stated.stored || found.owned_count() != stated.owned ||
      found.bytes() != stated.decoded_bytes)
    refuse(at);
  if (found.segment_count() > 0 && found.segmentId(found.segment_count() - 1).cell >= cell_count())
    refuse(at, "holds a segment of a cell that does not exist");
  return std::make_shared<const Tile>(std::move(found));
}

TileAppearance TileSet::loadAppearance(TileId tile) const {
  const TileEntry& stated = entry(tile);
  const internal::Patch* const patch = impl_->patch(tile);
  if (stated.owned > internal::kMostOwnedUnread) load(tile);
  if (patch == nullptr) return impl_->decodedAppearance(tile, location(tile), stated.owned);
  if (patch->owned > stated.owned) throw CorruptSet(describe(internal::kPatchesFile), 0, "contradicts the directory");
  TileAppearance look = impl_->decodedAppearance(tile, location(tile), patch->owned);
  internal::appendAppearance(impl_->decodedAppearance(tile, patch->at, stated.owned - patch->owned), look);
  return look;
}

bool TileSet::grown() const { return impl_->manifest().grown; }
const internal::TileLocation& TileSet::location(TileId tile) const { return impl_->directory.location(tile); }
const internal::Patch* TileSet::patch(TileId tile) const { return impl_->patch(tile); }
std::pair<Tile, TileAppearance> TileSet::loadPatch(TileId tile) const {
  const internal::Patch& patch = *impl_->patch(tile);
  return {impl_->decodedTile(tile, patch.at),
          impl_->decodedAppearance(tile, patch.at, entry(tile).owned - patch.owned)};
}
std::uint64_t TileSet::cellDigest(std::uint32_t id) const { return impl_->cells.digest(id); }
std::vector<std::uint8_t> TileSet::encodedDetail(std::uint32_t id) const { return impl_->cells.encodedDetail(id); }

std::uint32_t TileSet::cell_count() const { return static_cast<std::uint32_t>(counts().cells + counts().removed); }
const CellRecord& TileSet::cell(std::uint32_t id) const { return impl_->cells.record(id); }
std::optional<std::uint32_t> TileSet::findCell(const std::string& name) const { return impl_->cells.find(name); }
CellDetail TileSet::loadCellDetail(std::uint32_t id) const { return impl_->cells.detail(id, tile_count()); }
std::vector<TileId> TileSet::cellTiles(std::uint32_t id) const { return impl_->cells.tiles(id, tile_count()); }

const Landmarks& TileSet::landmarks() const {
  return impl_->landmarks.get([this] {
    const SetFile& f = impl_->revision.file(internal::kLandmarksFile);
    return std::make_unique<Landmarks>(
        impl_->revision.readDecoded(f.name, 0, f.bytes, [this](internal::ByteSpan bytes) {
          Landmarks found = internal::decodeLandmarks(bytes);
          for (const SegmentId& segment : found.segments)
            if (segment.cell >= cell_count()) throw internal::Damage{0, "a point lies on a cell that does not exist"};
          return found;
        }));
  });
}

std::uint32_t TileSet::format() const { return impl_->manifest().version; }
const std::string& TileSet::revision() const { return impl_->revision.name(); }
const std::string& TileSet::manifest() const { return impl_->revision.text(); }
std::string TileSet::readProvenance() const {
  const SetFile& f = impl_->revision.file(internal::kProvenanceFile);
  const Bytes bytes = impl_->revision.readChecked(f.name, 0, f.bytes, f.digest, "the file");
  return {bytes.begin(), bytes.end()};
}

std::uint64_t TileSet::refused() const { return impl_->manifest().refused; }
std::uint64_t TileSet::skipped() const { return impl_->manifest().skipped; }
const SetCounts& TileSet::counts() const { return impl_->manifest().counts; }
const GridBox& TileSet::bounds() const { return impl_->manifest().bounds; }
const std::vector<SetFile>& TileSet::files() const { return impl_->manifest().files; }

std::vector<std::string> TileSet::sections() const {
  std::vector<std::string> names;
  for (const SetFile& f : files())
    if (const std::string name = internal::sectionOf(f.name); !name.empty()) names.push_back(name);
  return names;
}

std::optional<std::vector<std::uint8_t>> TileSet::section(const std::string& name) const {
  const SetFile* const f = impl_->revision.find(internal::sectionFile(name));
  if (f == nullptr) return std::nullopt;
  return impl_->revision.readChecked(f->name, 0, f->bytes, f->digest, "the section");
}

std::uint64_t TileSet::bytes() const {
  std::uint64_t sum = manifest().size();
  for (const SetFile& f : files()) sum += f.bytes;
  return sum;
}

void TileSet::read(const std::string& file, std::uint64_t offset, std::span<std::uint8_t> bytes) const {
  impl_->revision.read(file, offset, bytes);
}

std::vector<std::uint8_t> TileSet::read(const std::string& file, std::uint64_t offset, std::uint64_t bytes) const {
  return impl_->revision.read(file, offset, bytes);
}

bool TileSet::discard(const std::string& file, std::uint64_t offset, std::uint64_t bytes) const {
  return impl_->revision.discard(file, offset, bytes);
}

std::string TileSet::describe(const std::string& file) const { return impl_->revision.describe(file); }

void TileSet::checkFile(const SetFile& f, const UseBytes& use) const {
  const std::uint64_t found = impl_->revision.sizeOnDisk(f.name);
  if (found != f.bytes)
    throw CorruptSet(describe(f.name), std::min(found, f.bytes),
                     "has " + counted(found, "byte") + ", the manifest says " + formatCount(f.bytes));
  internal::RunningDigest digest;
  constexpr std::uint64_t kPiece = std::uint64_t{4} << 20;
  for (std::uint64_t at = 0; at < f.bytes; at += kPiece) {
    const Bytes piece = impl_->revision.read(f.name, at, std::min(kPiece, f.bytes - at));
    digest.add(piece);
    if (use) use(piece);
  }
  if (digest.value() != f.digest) throw CorruptSet(describe(f.name), 0, "its digest differs from the manifest");
}

std::pair<std::string, std::uint64_t> TileSet::place(TileId tile) const {
  const internal::TileLocation& at = impl_->directory.location(tile);
  return {impl_->directory.packName(at.pack), at.offset};
}

}  // namespace filiform
