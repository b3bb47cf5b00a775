#include "index/set/tile_set.h"

#include "index/errors.h"
#include "index/file/internal/output_file.h"
#include "index/set/internal/cells_file.h"
#include "index/set/internal/directory_file.h"
#include "index/set/internal/landmarks_file.h"
#include "index/set/internal/manifest.h"
#include "index/set/internal/set_files.h"
#include "index/tile/tile_codec.h"

#include <algorithm>
#include <atomic>
#include <map>
#include <stdexcept>

namespace filiform {

using internal::Bytes;
using internal::Damage;

namespace {

// Calls a decoder of the file's bytes from `offset` on, and adds file and offset to its Damage.
template <typename Decode>
auto decoded(const std::string& file, std::uint64_t offset, Decode decode) {
  try {
    return decode();
  } catch (const Damage& damage) {
    throw CorruptSet(file, offset + damage.offset, damage.what);
  }
}

// A value read when first needed. The first thread reads it and the others wait; later calls never wait. After a
// failure, the next call reads again.
template <typename T>
class ReadOnce {
 public:
  template <typename Read>  // returns std::unique_ptr<const T>, or throws
  const T& get(Read read) {
    if (const T* const there = known()) return *there;
    const std::lock_guard lock(mutex_);
    if (owned_ == nullptr) {
      owned_ = read();
      known_.store(owned_.get(), std::memory_order_release);
    }
    return *owned_;
  }
  const T* known() const { return known_.load(std::memory_order_acquire); }

 private:
  std::mutex mutex_;
  std::unique_ptr<const T> owned_;
  std::atomic<const T*> known_{nullptr};
};

}  // namespace

struct TileSet::Impl {
  std::unique_ptr<TileSource> source;
  std::string revision, text;
  internal::Manifest manifest;
  internal::DirectoryRoot root;
  std::map<std::string, const SetFile*> files;
  std::vector<std::uint64_t> pack_bytes;
  std::vector<std::string> pack_names;  // for messages

  struct Page {
    std::atomic<const internal::DirectoryPage*> known{nullptr};
    std::unique_ptr<const internal::DirectoryPage> owned;
  };
  mutable std::mutex directory_mutex;  // held while a page is added, never while reading
  mutable std::unique_ptr<Page[]> pages;
  mutable std::atomic<std::uint32_t> pages_unknown{0};
  mutable LeafIndex leaves;
  mutable std::atomic<std::uint64_t> floor_bytes{UINT64_MAX};

  mutable ReadOnce<internal::CellTable> cells;
  mutable ReadOnce<Landmarks> landmarks;
  mutable std::atomic<bool> cells_header_checked{false};

  std::string key(const std::string& name) const { return revision + "/" + name; }
  std::string describe(const std::string& name) const { return source->describe(key(name)); }
  Bytes read(const std::string& name, std::uint64_t offset, std::uint64_t n) const {
    Bytes bytes(n);
    source->read(key(name), offset, bytes);
    return bytes;
  }
  const SetFile& file(const std::string& name) const {
    const auto found = files.find(name);
    if (found == files.end()) throw CorruptSet(describe(internal::kManifestFile), 0, "does not list " + name);
    return *found->second;
  }
  void openManifest();
  void openDirectory();
  internal::ReadPart directoryReader() const {
    return [this](std::uint64_t offset, std::span<std::uint8_t> bytes) {
      source->read(key(internal::kDirectoryFile), offset, bytes);
    };
  }
  const internal::DirectoryPage& readPage(std::uint32_t number) const;
  const internal::DirectoryPage& pageOf(TileId tile) const {
    if (tile >= root.tiles) throw std::out_of_range("the tile does not exist");
    const std::uint32_t number = tile / root.page_tiles;
    const internal::DirectoryPage* const known = pages[number].known.load(std::memory_order_acquire);
    return known != nullptr ? *known : readPage(number);
  }
  const TileEntry& entry(TileId tile) const { return pageOf(tile).entries[tile % root.page_tiles]; }
  const internal::TileLocation& location(TileId tile) const { return pageOf(tile).locations[tile % root.page_tiles]; }
  void knowHomes(const Tile& tile) const;
  Bytes part(TileId tile, bool appearance) const;
  TilePlace placeOf(TileId tile, bool appearance) const;
  const internal::CellTable& table() const;
  internal::DetailRecord detailRecord(std::uint32_t id) const;
};

void TileSet::Impl::openManifest() {
  const std::string current = source->describe("CURRENT");
  std::uint64_t size = 0;
  try {
    size = source->size("CURRENT");
  } catch (const IoError&) {
    throw IoError(current, "is missing, so the folder is not a tile set; make one with filiform ingest");
  }
  Bytes name(std::min<std::uint64_t>(size, 64));
  source->read("CURRENT", 0, name);
  revision.assign(name.begin(), name.end());
  if (size != 19 || revision.back() != '\n' || (revision.pop_back(), !internal::isRevisionName(revision)))
    throw CorruptSet(current, 0, "does not name a revision");
  const Bytes bytes = read(internal::kManifestFile, 0, source->size(key(internal::kManifestFile)));
  text.assign(bytes.begin(), bytes.end());
  const std::string file_name = describe(internal::kManifestFile);
  if (internal::revisionName(text) != revision)
    throw CorruptSet(file_name, 0, "its digest differs from the revision's name");
  manifest = decoded(file_name, 0, [&] { return internal::decodeManifest(text); });
  for (const SetFile& f : manifest.files) {
    files[f.name] = &f;
    const std::uint64_t found = source->size(key(f.name));
    if (found != f.bytes)
      throw CorruptSet(describe(f.name), std::min(found, f.bytes),
                       "has " + std::to_string(found) + " bytes, the manifest says " + std::to_string(f.bytes));
  }
}

void TileSet::Impl::openDirectory() {
  const SetFile& f = file(internal::kDirectoryFile);
  const std::string name = describe(f.name);
  root = decoded(name, 0, [&] { return internal::decodeDirectoryRoot(f.bytes, directoryReader()); });
  for (auto found = files.find(internal::packFile(0)); found != files.end();
       found = files.find(internal::packFile(static_cast<std::uint32_t>(pack_bytes.size())))) {
    pack_bytes.push_back(found->second->bytes);
    pack_names.push_back(describe(found->first));
  }
  if (root.tiles != manifest.counts.tiles || root.capacity != manifest.capacity ||
      root.grid.exponent() != manifest.grid.exponent())
    throw CorruptSet(name, 0, "contradicts the manifest");
  pages = std::make_unique<Page[]>(root.pages.size());
  pages_unknown = static_cast<std::uint32_t>(root.pages.size());
  std::vector<MortonKey> lows;
  for (std::uint32_t page = 0; root.pageBegin(page) < root.leaf_count(); ++page) lows.push_back(root.pages[page].low);
  leaves = LeafIndex(std::move(lows), root.page_tiles, root.leaf_count());
}

const internal::DirectoryPage& TileSet::Impl::readPage(std::uint32_t number) const {
  // Two threads may read the same page at once: the first to finish adds it.
  const std::string name = describe(internal::kDirectoryFile);
  auto found = std::make_unique<internal::DirectoryPage>(
      decoded(name, 0, [&] { return internal::decodeDirectoryPage(root, number, directoryReader()); }));
  const TileId begin = root.pageBegin(number);
  for (std::size_t t = 0; t < found->entries.size(); ++t) {
    const internal::TileLocation& at = found->locations[t];
    const std::uint64_t bytes_needed = std::uint64_t{at.geometry_bytes} + at.appearance_bytes;
    if (at.pack >= pack_bytes.size() || at.offset > pack_bytes[at.pack] ||
        bytes_needed > pack_bytes[at.pack] - at.offset) {
      std::string what = "tile " + std::to_string(begin + t);
      what += " lies outside the packs";
      throw CorruptSet(name, 0, what);
    }
  }
  std::vector<BlockKey> keys;
  keys.reserve(found->entries.size());
  for (std::size_t t = 0; t < found->entries.size() && begin + t < root.leaf_count(); ++t)
    keys.push_back(found->entries[t].key);
  const std::lock_guard lock(directory_mutex);
  Page& page = pages[number];
  if (page.owned != nullptr) return *page.owned;
  if (!keys.empty()) leaves.add(number, std::move(keys));
  page.owned = std::move(found);
  page.known.store(page.owned.get(), std::memory_order_release);
  pages_unknown.fetch_sub(1, std::memory_order_release);
  return *page.owned;
}

// The haptic thread cannot read. This makes the homes of all nodes in its tiles known.
void TileSet::Impl::knowHomes(const Tile& tile) const {
  if (pages_unknown.load(std::memory_order_acquire) == 0 || tile.node_count() == 0) return;
  // Keys increase with each coordinate: all nodes lie in the pages between the two corners of their box.
  constexpr std::int64_t kLast = (std::int64_t{1} << (kMortonAxisBits - 1)) - 1;
  const GridPoint far = tile.origin().array() + ((std::int64_t{1} << tile.offset_bits()) - 1);
  const auto known = [this](std::size_t page) { return page == LeafIndex::kNoPage || leaves.knows(page); };
  const std::size_t first = leaves.pageOf(tile.origin()), last = leaves.pageOf(far.cwiseMin(kLast));
  bool all = true;
  for (std::size_t page = first == LeafIndex::kNoPage ? 0 : first; page <= last && last != LeafIndex::kNoPage; ++page)
    all = all && known(page);
  if (all) return;
  for (std::uint32_t node = 0; node < tile.node_count(); ++node) {
    if (tile.isHome(node)) continue;
    const std::size_t page = leaves.pageOf(tile.gridPoint(node));
    if (!known(page)) readPage(static_cast<std::uint32_t>(page));
  }
}

TilePlace TileSet::Impl::placeOf(TileId tile, bool appearance) const {
  const internal::TileLocation& at = location(tile);
  return {tile, entry(tile).key, tile == root.long_tile, pack_names[at.pack].c_str(),
          at.offset + (appearance ? at.geometry_bytes : 0)};
}

Bytes TileSet::Impl::part(TileId tile, bool appearance) const {
  const internal::TileLocation& at = location(tile);
  const TilePlace place = placeOf(tile, appearance);
  Bytes bytes = read(internal::packFile(at.pack), place.offset, appearance ? at.appearance_bytes : at.geometry_bytes);
  if (internal::checksum(bytes) != (appearance ? at.appearance_checksum : at.geometry_checksum))
    throw CorruptTile(tile, place.file, place.offset,
                      appearance ? "the appearance's checksum is wrong" : "its checksum is wrong");
  return bytes;
}

const internal::CellTable& TileSet::Impl::table() const {
  return cells.get([this] {
    const SetFile& f = file(internal::kCellsFile);
    const std::string name = describe(f.name);
    const Bytes header = read(f.name, 0, std::min<std::uint64_t>(f.bytes, internal::kCellsHeaderBytes));
    const std::uint64_t size = decoded(name, 0, [&] { return internal::cellTableBytes(header, f.bytes); });
    const Bytes bytes = read(f.name, 0, size);
    auto read_cells =
        std::make_unique<internal::CellTable>(decoded(name, 0, [&] { return internal::decodeCells(bytes); }));
    SetCounts sum = manifest.counts;
    sum.samples = sum.segments = sum.isolated = sum.roots = 0;
    sum.cells = read_cells->records.size();
    for (const CellRecord& r : read_cells->records)
      sum.samples += r.samples, sum.segments += r.segments, sum.isolated += r.isolated, sum.roots += r.roots;
    if (sum != manifest.counts) throw CorruptSet(name, 0, "contradicts the manifest");
    for (const internal::DetailPlace& d : read_cells->details)
      if (d.offset > f.bytes || d.bytes > f.bytes - d.offset) throw CorruptSet(name, 0, "a cell lies outside the file");
    return read_cells;
  });
}

internal::DetailRecord TileSet::Impl::detailRecord(std::uint32_t id) const {
  if (id >= manifest.counts.cells) throw std::out_of_range("the cell does not exist");
  if (const internal::CellTable* const known = cells.known())
    return {known->records[id].samples, known->records[id].roots, known->details[id]};
  const SetFile& f = file(internal::kCellsFile);
  const std::string name = describe(f.name);
  if (!cells_header_checked.load(std::memory_order_relaxed)) {
    const Bytes header = read(f.name, 0, std::min<std::uint64_t>(f.bytes, internal::kCellsHeaderBytes));
    decoded(name, 0, [&] { return internal::cellTableBytes(header, f.bytes); });
    cells_header_checked.store(true, std::memory_order_relaxed);
  }
  const std::uint64_t at = internal::cellRecordAt(id);
  const Bytes bytes = read(f.name, at, internal::kCellRecordBytes);
  const internal::DetailRecord record = decoded(name, at, [&] { return internal::decodeDetailRecord(bytes); });
  if (record.place.offset > f.bytes || record.place.bytes > f.bytes - record.place.offset)
    throw CorruptSet(name, at, "a cell lies outside the file");
  return record;
}

TileSet::TileSet(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TileSet::~TileSet() = default;

std::unique_ptr<TileSet> TileSet::open(const std::string& path) {
  // A new revision may be published between reading CURRENT and opening the first file: then start again.
  for (int attempt = 0;; ++attempt) {
    try {
      return open(openFolder(path));
    } catch (const IoError&) {
      if (attempt == 2) throw;
    }
  }
}

std::unique_ptr<TileSet> TileSet::open(std::unique_ptr<TileSource> source) {
  auto impl = std::make_unique<Impl>();
  impl->source = std::move(source);
  impl->openManifest();
  impl->openDirectory();
  return std::unique_ptr<TileSet>(new TileSet(std::move(impl)));
}

Grid TileSet::grid() const { return impl_->manifest.grid; }
const LeafIndex& TileSet::leaves() const { return impl_->leaves; }
TileId TileSet::home(const GridPoint& p) const {
  const std::size_t page = impl_->leaves.pageOf(p);
  if (page == LeafIndex::kNoPage) return kNoTile;
  if (!impl_->leaves.knows(page)) impl_->readPage(static_cast<std::uint32_t>(page));
  return impl_->leaves.home(p);
}
TileId TileSet::tile_count() const { return impl_->root.tiles; }
TileId TileSet::long_tile() const { return impl_->root.long_tile; }
const TileEntry& TileSet::entry(TileId tile) const { return impl_->entry(tile); }
TileId TileSet::page_tiles() const { return impl_->root.page_tiles; }
GridBox TileSet::pageContent(std::uint32_t page) const { return impl_->root.pages.at(page).content; }

std::uint64_t TileSet::floorBytes() const {
  if (const std::uint64_t known = impl_->floor_bytes.load(); known != UINT64_MAX) return known;
  const internal::DirectoryRoot& root = impl_->root;
  TileFloor floor;
  Bytes scratch;
  std::vector<std::uint64_t> bytes;
  for (std::uint32_t page = 0; page < root.pages.size(); ++page) {
    decoded(impl_->describe(internal::kDirectoryFile), 0,
            [&] { internal::readDecodedBytes(root, page, impl_->directoryReader(), scratch, bytes); });
    for (std::size_t t = 0; t < bytes.size(); ++t)
      floor.add(bytes[t], root.pageBegin(page) + static_cast<TileId>(t) == root.long_tile);
  }
  impl_->floor_bytes.store(floor.bytes());
  return floor.bytes();
}

void TileSet::checkDirectory() const {
  SetCounts sum = counts();
  sum.stored_segments = sum.decoded_bytes = 0;
  std::uint64_t owned = 0;
  for (TileId tile = 0; tile < tile_count(); ++tile) {
    const TileEntry& e = entry(tile);
    sum.stored_segments += e.stored;
    sum.decoded_bytes += e.decoded_bytes;
    owned += e.owned;
  }
  if (sum != counts() || owned != counts().segments + counts().isolated)
    throw CorruptSet(impl_->describe(internal::kDirectoryFile), 0, "contradicts the manifest");
}
std::uint32_t TileSet::capacity() const { return impl_->manifest.capacity; }

std::shared_ptr<const Tile> TileSet::load(TileId tile) const {
  const TileEntry& stated = entry(tile);
  const Bytes bytes = impl_->part(tile, false);
  const TilePlace place = impl_->placeOf(tile, false);
  auto loaded = std::make_shared<const Tile>(decodeTile(bytes, place, grid()));
  if (loaded->segment_count() != stated.stored || loaded->owned_count() != stated.owned ||
      loaded->bytes() != stated.decoded_bytes)
    throw CorruptTile(tile, place.file, place.offset, "contradicts the directory");
  impl_->knowHomes(*loaded);
  return loaded;
}

TileAppearance TileSet::loadAppearance(TileId tile) const {
  const TileEntry& stated = entry(tile);
  const Bytes bytes = impl_->part(tile, true);
  return decodeAppearance(bytes, impl_->placeOf(tile, true), stated.stored);
}

std::uint32_t TileSet::cell_count() const { return static_cast<std::uint32_t>(impl_->manifest.counts.cells); }
const CellRecord& TileSet::cell(std::uint32_t id) const { return impl_->table().records.at(id); }

std::optional<std::uint32_t> TileSet::findCell(const std::string& name) const {
  const internal::CellTable& table = impl_->table();
  const auto found =
      std::lower_bound(table.by_name.begin(), table.by_name.end(), name,
                       [&](std::uint32_t id, const std::string& n) { return table.records[id].name < n; });
  if (found == table.by_name.end() || table.records[*found].name != name) return std::nullopt;
  return *found;
}

CellDetail TileSet::loadCellDetail(std::uint32_t id) const {
  const internal::DetailRecord record = impl_->detailRecord(id);
  const internal::DetailPlace& at = record.place;
  const std::string name = impl_->describe(internal::kCellsFile);
  const Bytes bytes = impl_->read(internal::kCellsFile, at.offset, at.bytes);
  if (internal::checksum(bytes) != at.checksum)
    throw CorruptSet(name, at.offset, "the checksum of cell " + std::to_string(id) + " is wrong");
  CellDetail detail = decoded(name, at.offset, [&] { return internal::decodeDetail(bytes, record.samples); });
  if (detail.roots.size() != record.roots || (!detail.tiles.empty() && detail.tiles.back() >= tile_count()))
    throw CorruptSet(name, at.offset, "cell " + std::to_string(id) + " contradicts its record");
  return detail;
}

const Landmarks& TileSet::landmarks() const {
  return impl_->landmarks.get([this] {
    const SetFile& f = impl_->file(internal::kLandmarksFile);
    const Bytes bytes = impl_->read(f.name, 0, f.bytes);
    return std::make_unique<Landmarks>(
        decoded(impl_->describe(f.name), 0, [&] { return internal::decodeLandmarks(bytes); }));
  });
}

const std::string& TileSet::revision() const { return impl_->revision; }
const std::string& TileSet::manifest() const { return impl_->text; }
std::string TileSet::readProvenance() const {
  const SetFile& f = impl_->file(internal::kProvenanceFile);
  const Bytes bytes = impl_->read(f.name, 0, f.bytes);
  if (internal::checksum(bytes) != f.digest)
    throw CorruptSet(impl_->describe(f.name), 0, "its digest differs from the manifest");
  return {bytes.begin(), bytes.end()};
}

std::uint64_t TileSet::refused() const { return impl_->manifest.refused; }
const SetCounts& TileSet::counts() const { return impl_->manifest.counts; }
const GridBox& TileSet::bounds() const { return impl_->manifest.bounds; }
const std::vector<SetFile>& TileSet::files() const { return impl_->manifest.files; }

std::uint64_t TileSet::bytes() const {
  std::uint64_t sum = impl_->text.size();
  for (const SetFile& f : impl_->manifest.files) sum += f.bytes;
  return sum;
}

void TileSet::read(const std::string& file, std::uint64_t offset, std::span<std::uint8_t> bytes) const {
  impl_->source->read(impl_->key(file), offset, bytes);
}

std::string TileSet::describe(const std::string& file) const { return impl_->describe(file); }

void TileSet::checkFile(const SetFile& f) const {
  internal::RunningDigest digest;
  constexpr std::uint64_t kPiece = std::uint64_t{4} << 20;
  for (std::uint64_t at = 0; at < f.bytes; at += kPiece)
    digest.add(impl_->read(f.name, at, std::min(kPiece, f.bytes - at)));
  if (digest.value() != f.digest) throw CorruptSet(impl_->describe(f.name), 0, "its digest differs from the manifest");
}

std::pair<std::string, std::uint64_t> TileSet::place(TileId tile) const {
  const internal::TileLocation& at = impl_->location(tile);
  return {impl_->pack_names[at.pack], at.offset};
}

}  // namespace filiform
