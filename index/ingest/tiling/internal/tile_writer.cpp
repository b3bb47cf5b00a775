#include "index/ingest/tiling/internal/tile_writer.h"

#include "index/errors.h"
#include "index/file/internal/digest.h"
#include "index/file/internal/output_file.h"
#include "index/set/internal/cells_file.h"
#include "index/set/internal/directory_file.h"
#include "index/set/internal/landmarks_file.h"
#include "index/set/internal/manifest.h"
#include "index/set/internal/pack_writer.h"
#include "index/set/usual_box.h"
#include "index/tile/tile_codec.h"

#include <algorithm>
#include <utility>

namespace filiform {

using internal::Bytes;
using internal::ByteSpan;

struct TileWriter::Impl {
  Impl(std::string into, std::uint64_t most_pack_bytes)
      : folder(std::move(into)),
        pack_bytes(most_pack_bytes),
        packs(folder, {internal::packFile, [](std::uint32_t pack) { return internal::packHeader(pack); }}, pack_bytes) {
  }

  std::string folder;
  std::uint64_t pack_bytes;
  internal::DirectoryShape shape;  // of the directory
  internal::DirectoryContents directory;
  internal::Manifest manifest;
  internal::PackWriter packs;
  std::uint64_t bytes = 0;

  void list(const SetFile& file) {
    manifest.files.push_back(file);
    bytes += file.bytes;
  }
  void closeFile(const std::string& name, internal::OutputFile& file) {
    file.close();
    list({name, file.bytes(), file.digest()});
  }
  void writeFile(const std::string& name, ByteSpan content) {
    internal::OutputFile file(folder + "/" + name);
    file.write(content);
    closeFile(name, file);
  }
  void closePacks() {
    for (const SetFile& file : packs.close()) list(file);
  }
};

TileWriter::TileWriter(std::string folder, const Grid& grid, std::uint32_t capacity, std::uint64_t pack_bytes,
                       const internal::DirectoryShape& shape)
    : impl_(std::make_unique<Impl>(std::move(folder), pack_bytes)) {
  impl_->shape = shape;
  impl_->manifest.grid = grid;
  impl_->manifest.capacity = capacity;
}

TileWriter::~TileWriter() = default;

void TileWriter::growFrom(std::uint32_t pack) {
  impl_->manifest.grown = true;
  impl_->packs.numberFrom(pack);
}

void TileWriter::reserve(std::size_t tiles) {
  impl_->directory.entries.reserve(tiles);
  impl_->directory.locations.reserve(tiles);
}

void TileWriter::add(const TileEntry& entry, ByteSpan geometry, ByteSpan appearance, bool is_long) {
  addPlaced(entry, append(geometry, appearance), is_long);
}

const internal::TileLocation& TileWriter::location(TileId tile) const { return impl_->directory.locations[tile]; }

void TileWriter::addPlaced(const TileEntry& entry, const internal::TileLocation& at, bool is_long) {
  if (is_long) impl_->directory.long_tile = static_cast<TileId>(impl_->directory.entries.size());
  impl_->directory.locations.push_back(at);
  impl_->directory.entries.push_back(entry);
  SetCounts& counts = impl_->manifest.counts;
  ++counts.tiles;
  counts.stored_segments += entry.stored;
  counts.decoded_bytes += entry.decoded_bytes;
}

internal::TileLocation TileWriter::append(ByteSpan geometry, ByteSpan appearance) {
  return impl_->packs.add(geometry, appearance,
                          "a tile takes more than 4 GiB: too many segments have the same midpoint");
}

void TileWriter::refer(const SetFile& file) { impl_->list(file); }

void TileWriter::setTiles(internal::DirectoryContents tiles, const std::vector<internal::Patch>& patches) {
  impl_->directory = std::move(tiles);
  SetCounts& counts = impl_->manifest.counts;
  counts.tiles = impl_->directory.entries.size();
  for (const TileEntry& entry : impl_->directory.entries) {
    counts.stored_segments += entry.stored;
    counts.decoded_bytes += entry.decoded_bytes;
  }
  if (!patches.empty()) impl_->writeFile(internal::kPatchesFile, internal::encodePatches(patches));
}

std::vector<std::string> TileWriter::revisionsInUse() const {
  std::vector<std::string> names;
  for (const SetFile& file : impl_->manifest.files)
    if (!file.revision.empty()) names.push_back(file.revision);
  return names;
}

void TileWriter::writeCells(const std::vector<CellRecord>& records, const std::vector<std::uint64_t>& digests,
                            const std::function<void(const UseDetail& use)>& details) {
  SetCounts& counts = impl_->manifest.counts;
  for (const CellRecord& record : records) {
    ++(record.removed ? counts.removed : counts.cells);
    counts.samples += record.samples;
    counts.segments += record.segments;
    counts.isolated += record.isolated;
    counts.roots += record.roots;
    impl_->manifest.bounds.extend(record.bounds);
  }
  std::vector<internal::DetailPlace> places;
  places.reserve(records.size());
  internal::OutputFile file(impl_->folder + "/" + internal::kCellsFile);
  file.write(internal::cellsHeader());
  details([&](ByteSpan detail) {
    places.push_back({file.bytes(), detail.size(), internal::checksum(detail)});
    file.write(detail);
  });
  const Bytes root =
      internal::writeCellPages({records, digests, places}, file.bytes(), [&](ByteSpan page) { file.write(page); });
  file.write(root);
  impl_->manifest.cells_root_bytes = root.size();
  impl_->manifest.cells_root_checksum = internal::checksum(root);
  impl_->closeFile(internal::kCellsFile, file);
}

void TileWriter::writeSection(const std::string& name, ByteSpan bytes) {
  const std::string file = internal::sectionFile(name);
  if (internal::sectionOf(file) != name)
    throw UsageError("a section's name has 1 to 64 lower-case letters, digits and hyphens: " + name);
  impl_->writeFile(file, bytes);
}

void TileWriter::writeLandmarks(const Landmarks& landmarks) {
  impl_->manifest.covering_radius_um = landmarks.covering_radius_um;
  impl_->writeFile(internal::kLandmarksFile, internal::encodeLandmarks(landmarks));
}

void TileWriter::writeLevels(LevelInput input, LevelOptions options) {
  const internal::DirectoryContents& directory = impl_->directory;
  std::vector<BlockKey> leaves;
  std::vector<std::uint32_t> segments;
  for (TileId t = 0; t < directory.entries.size(); ++t) {
    if (t == directory.long_tile) continue;
    leaves.push_back(directory.entries[t].key);
    segments.push_back(directory.entries[t].owned);
  }
  input.grid = impl_->manifest.grid;
  input.leaves = leaves;
  input.segments = segments;
  options.pack_bytes = impl_->pack_bytes;
  for (const SetFile& file : filiform::writeLevels(input, options, impl_->folder)) impl_->list(file);
}

std::string TileWriter::finish(const Provenance& provenance) {
  impl_->closePacks();
  {
    internal::OutputFile file(impl_->folder + "/" + internal::kDirectoryFile);
    impl_->manifest.directory_root =
        internal::writeDirectory(impl_->directory, impl_->shape, [&](ByteSpan page) { file.write(page); });
    impl_->closeFile(internal::kDirectoryFile, file);
  }
  TileFloor floor;
  for (TileId t = 0; t < impl_->directory.entries.size(); ++t)
    floor.add(impl_->directory.entries[t].decoded_bytes, t == impl_->directory.long_tile);
  impl_->manifest.floor_bytes = floor.bytes();
  impl_->manifest.usual = usualBoxOf(impl_->directory.entries, impl_->directory.long_tile);
  {
    internal::OutputFile origin(impl_->folder + "/" + internal::kProvenanceFile);
    internal::writeProvenance(provenance, [&](std::string_view piece) { origin.write(piece); });
    impl_->closeFile(internal::kProvenanceFile, origin);
  }
  std::sort(impl_->manifest.files.begin(), impl_->manifest.files.end(),
            [](const SetFile& a, const SetFile& b) { return a.name < b.name; });
  const std::string text = internal::encodeManifest(impl_->manifest, provenance);
  internal::OutputFile file(impl_->folder + "/" + internal::kManifestFile);
  file.write(text);
  file.close();
  impl_->bytes += text.size();
  internal::syncFolder(impl_->folder);
  return internal::revisionName(text);
}

std::uint64_t TileWriter::tiles() const { return impl_->directory.entries.size(); }
const SetCounts& TileWriter::counts() const { return impl_->manifest.counts; }
std::uint64_t TileWriter::bytes() const { return impl_->bytes; }

}  // namespace filiform
