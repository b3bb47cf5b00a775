#include "index/tile_set.h"

#include "index/errors.h"
#include "index/internal/output_file.h"
#include "index/internal/set_files.h"
#include "index/tile_codec.h"

#include <algorithm>
#include <map>

namespace filiform {

using internal::Bytes;
using internal::Damage;

namespace {

// Calls a decoder of the file's bytes from `offset` on, and says where they are damaged.
template <typename Decode>
auto decoded(const std::string& file, std::uint64_t offset, Decode decode) {
  try {
    return decode();
  } catch (const Damage& damage) {
    throw CorruptSet(file, offset + damage.offset, damage.what);
  }
}

}  // namespace

struct TileSet::Impl {
  std::unique_ptr<TileSource> source;
  std::string revision, text;
  internal::Manifest manifest;
  internal::Directory directory;
  std::map<std::string, const SetFile*> files;
  std::vector<std::string> pack_names;  // for messages, by pack
  LeafIndex leaves;

  mutable std::mutex mutex;  // of what is read at first need
  mutable std::unique_ptr<internal::CellTable> cells;
  mutable std::unique_ptr<SamplePoints> samples;

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
  Bytes part(TileId tile, bool appearance) const;
  TilePlace placeOf(TileId tile, bool appearance) const;
  const internal::CellTable& table() const;
};

void TileSet::Impl::openManifest() {
  const std::string current = source->describe("CURRENT");
  std::uint64_t size = 0;
  try {
    size = source->size("CURRENT");
  } catch (const IoError&) {
    throw IoError(current, "not a tile set: it has no CURRENT; make one with filiform ingest");
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
    throw CorruptSet(file_name, 0, "its digest is not that of the revision's name");
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
  directory = decoded(name, 0, [&] {
    return internal::decodeDirectory(f.bytes, [&](std::uint64_t offset, std::span<std::uint8_t> bytes) {
      source->read(key(f.name), offset, bytes);
    });
  });
  std::vector<std::uint64_t> pack_bytes;
  for (auto found = files.find(internal::packFile(0)); found != files.end();
       found = files.find(internal::packFile(static_cast<std::uint32_t>(pack_bytes.size())))) {
    pack_bytes.push_back(found->second->bytes);
    pack_names.push_back(describe(found->first));
  }
  SetCounts sum;
  for (std::size_t t = 0; t < directory.entries.size(); ++t) {
    const internal::TileLocation& at = directory.locations[t];
    const std::uint64_t bytes_needed = std::uint64_t{at.geometry_bytes} + at.appearance_bytes;
    if (at.pack >= pack_bytes.size() || at.offset > pack_bytes[at.pack] ||
        bytes_needed > pack_bytes[at.pack] - at.offset)
      throw CorruptSet(name, 0, "tile " + std::to_string(t) + " lies outside the packs");
    sum.stored_segments += directory.entries[t].stored;
    sum.decoded_bytes += directory.entries[t].decoded_bytes;
    sum.segments += directory.entries[t].owned;
  }
  const SetCounts& counts = manifest.counts;
  if (directory.entries.size() != counts.tiles || sum.stored_segments != counts.stored_segments ||
      sum.decoded_bytes != counts.decoded_bytes || sum.segments != counts.segments + counts.isolated ||
      directory.capacity != manifest.capacity || directory.grid.exponent() != manifest.grid.exponent())
    throw CorruptSet(name, 0, "contradicts the manifest");
  std::vector<CellKey> keys;
  keys.reserve(directory.entries.size());
  for (std::size_t t = 0; t < directory.entries.size(); ++t)
    if (t != directory.long_tile) keys.push_back(directory.entries[t].key);
  leaves = LeafIndex(std::move(keys));
}

TilePlace TileSet::Impl::placeOf(TileId tile, bool appearance) const {
  const internal::TileLocation& at = directory.locations[tile];
  return {tile, directory.entries[tile].key, tile == directory.long_tile, pack_names[at.pack].c_str(),
          at.offset + (appearance ? at.geometry_bytes : 0)};
}

Bytes TileSet::Impl::part(TileId tile, bool appearance) const {
  const internal::TileLocation& at = directory.locations[tile];
  const TilePlace place = placeOf(tile, appearance);
  Bytes bytes = read(internal::packFile(at.pack), place.offset, appearance ? at.appearance_bytes : at.geometry_bytes);
  if (internal::checksum(bytes) != (appearance ? at.appearance_checksum : at.geometry_checksum))
    throw CorruptTile(tile, place.file, place.offset,
                      appearance ? "the appearance's checksum is wrong" : "its checksum is wrong");
  return bytes;
}

const internal::CellTable& TileSet::Impl::table() const {
  const std::lock_guard lock(mutex);
  if (cells == nullptr) {
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
    cells = std::move(read_cells);
  }
  return *cells;
}

TileSet::TileSet(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TileSet::~TileSet() = default;

std::unique_ptr<TileSet> TileSet::open(const std::string& path) {
  // Between CURRENT and the first file of its revision, a new revision may take its place: then begin again.
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
TileId TileSet::tile_count() const { return static_cast<TileId>(impl_->directory.entries.size()); }
TileId TileSet::long_tile() const { return impl_->directory.long_tile; }
const TileEntry& TileSet::entry(TileId tile) const { return impl_->directory.entries.at(tile); }
std::uint32_t TileSet::capacity() const { return impl_->manifest.capacity; }

std::shared_ptr<const Tile> TileSet::load(TileId tile) const {
  const TileEntry& stated = entry(tile);
  const Bytes bytes = impl_->part(tile, false);
  const TilePlace place = impl_->placeOf(tile, false);
  auto loaded = std::make_shared<const Tile>(decodeTile(bytes, place, grid()));
  if (loaded->segment_count() != stated.stored || loaded->owned_count() != stated.owned ||
      loaded->bytes() != stated.decoded_bytes)
    throw CorruptTile(tile, place.file, place.offset, "contradicts the directory");
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
  const internal::CellTable& table = impl_->table();
  const CellRecord& record = table.records.at(id);
  const internal::DetailPlace& at = table.details[id];
  const std::string name = impl_->describe(internal::kCellsFile);
  const Bytes bytes = impl_->read(internal::kCellsFile, at.offset, at.bytes);
  if (internal::checksum(bytes) != at.checksum)
    throw CorruptSet(name, at.offset, "the checksum of cell " + std::to_string(id) + " is wrong");
  CellDetail detail = decoded(name, at.offset, [&] { return internal::decodeDetail(bytes, record.samples); });
  if (detail.roots.size() != record.roots || (!detail.tiles.empty() && detail.tiles.back() >= tile_count()))
    throw CorruptSet(name, at.offset, "cell " + std::to_string(id) + " contradicts its record");
  return detail;
}

const SamplePoints& TileSet::samples() const {
  const std::lock_guard lock(impl_->mutex);
  if (impl_->samples == nullptr) {
    const SetFile& f = impl_->file(internal::kSamplesFile);
    const Bytes bytes = impl_->read(f.name, 0, f.bytes);
    impl_->samples = std::make_unique<SamplePoints>(
        decoded(impl_->describe(f.name), 0, [&] { return internal::decodeSamples(bytes); }));
  }
  return *impl_->samples;
}

const std::string& TileSet::revision() const { return impl_->revision; }
const std::string& TileSet::manifest() const { return impl_->text; }
std::string TileSet::readProvenance() const {
  const SetFile& f = impl_->file(internal::kProvenanceFile);
  const Bytes bytes = impl_->read(f.name, 0, f.bytes);
  if (internal::checksum(bytes) != f.digest)
    throw CorruptSet(impl_->describe(f.name), 0, "its digest is not that of the manifest");
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
  if (digest.value() != f.digest)
    throw CorruptSet(impl_->describe(f.name), 0, "its digest is not that of the manifest");
}

std::pair<std::string, std::uint64_t> TileSet::place(TileId tile) const {
  const internal::TileLocation& at = impl_->directory.locations.at(tile);
  return {impl_->pack_names[at.pack], at.offset};
}

}  // namespace filiform
