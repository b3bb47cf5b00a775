#include "index/file/internal/digest.h"
#include "index/levels/internal/level_files.h"
#include "index/set/internal/cells_file.h"
#include "index/set/internal/directory_file.h"
#include "index/set/internal/landmarks_file.h"
#include "index/set/internal/manifest.h"
#include "index/set/internal/patches_file.h"
#include "tests/fuzz/fuzz_bytes.h"

namespace filiform::fuzz {
namespace {

using internal::Bytes;
using internal::ByteSpan;
using internal::Damage;

std::uint32_t u32At(const Bytes& bytes, std::size_t at) {
  std::uint32_t value = 0;
  if (at + sizeof value <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

// Writes the checksum of [begin, end) at `at`, if these bytes exist. Otherwise every mutation would stop at the
// checksum.
void seal(Bytes& bytes, std::size_t at, std::size_t begin, std::size_t end) {
  end = std::min(end, bytes.size());
  if (begin > end || at + 8 > bytes.size()) return;
  internal::storeLittle64(bytes.data() + at, internal::checksum(ByteSpan(bytes).subspan(begin, end - begin)));
}

// Corrects the checksums of a root page: those of the pages that it lists, and its own.
void sealPages(Bytes& bytes, std::size_t header, std::size_t entry, std::size_t own_at, std::size_t tile) {
  const std::size_t per_page = u32At(bytes, 12), pages = std::min<std::size_t>(u32At(bytes, 20), bytes.size() / entry);
  const std::size_t root = header + pages * entry;
  for (std::size_t page = 0; page < pages; ++page)
    seal(bytes, header + page * entry + entry - 8, root + page * per_page * tile, root + (page + 1) * per_page * tile);
  if (own_at + 8 <= bytes.size()) internal::storeLittle64(bytes.data() + own_at, 0);
  seal(bytes, own_at, 0, root);
}

internal::ReadPart readerOf(const Bytes& bytes) {
  return [&bytes](std::uint64_t offset, std::uint64_t size) {
    require(offset <= bytes.size() && size <= bytes.size() - offset, "never beyond the file");
    const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(offset);
    return Bytes(from, from + static_cast<std::ptrdiff_t>(size));
  };
}

// Of version 2: a root and a file. The checksums of both levels of pages are made valid.
void oldDirectory(Input input) {
  Taker in(input);
  const std::size_t groups = in.number<std::uint8_t>() % 8;
  Bytes root(std::min<std::size_t>(16 + 72 * groups, in.rest().size()));
  for (std::uint8_t& byte : root) byte = in.number<std::uint8_t>();
  Bytes file(in.rest().begin(), in.rest().end());
  const std::uint64_t tiles = u32At(root, 0), page_tiles = std::max(1u, u32At(root, 8)),
                      group_pages = std::max(1u, u32At(root, 12));
  const std::uint64_t pages = std::min<std::uint64_t>((tiles + page_tiles - 1) / page_tiles, file.size() / 72);
  for (std::uint64_t page = 0; page < pages; ++page) {
    const std::uint64_t from = 16 + 72 * pages + page * page_tiles * 128;
    seal(file, 16 + 72 * page + 64, from, 16 + 72 * pages + std::min(tiles, (page + 1) * page_tiles) * 128);
  }
  for (std::uint64_t group = 0; group < groups; ++group) {
    const std::uint64_t from = 16 + 72 * group * group_pages,
                        to = 16 + 72 * std::min<std::uint64_t>(pages, (group + 1) * group_pages);
    const std::size_t at = 16 + 72 * group + 64;
    if (at + 8 > root.size() || from > to || to > file.size()) continue;
    internal::storeLittle64(root.data() + at, internal::checksum(ByteSpan(file).subspan(from, to - from)));
  }
  const internal::DirectoryContents found = internal::decodeDirectory(root, 2, file.size(), readerOf(file));
  require(found.entries.size() == found.locations.size(), "a place for each tile");
  for (const TileEntry& entry : found.entries) require(entry.owned <= entry.stored, "counts agree");
}

void directoryRoot(Input input) {
  Taker in(input);
  const std::uint32_t file_bytes = in.number<std::uint32_t>();
  const internal::DirectoryRoot root =
      internal::decodeDirectoryRoot(Bytes(in.rest().begin(), in.rest().end()), internal::kFormatVersion, file_bytes);
  for (const internal::DirectoryRecord& group : root.groups)
    require(group.at + group.bytes_with_pages <= file_bytes && !group.boxes.empty(), "inner pages lie in the file");
}

// A file of one page, of which everything is known that its parent states.
struct OnePage {
  explicit OnePage(Taker& in) {
    root.tiles = in.number<std::uint8_t>();
    root.page_tiles = std::uint32_t{1} << in.number<std::uint8_t>() % 8;
    root.group_pages = std::uint32_t{1} << in.number<std::uint8_t>() % 8;
    if (in.number<std::uint8_t>() % 2 == 0 && root.tiles > 0) root.long_tile = root.tiles - 1;
    stated.low = in.number<MortonKey>();
    for (GridPoint* const corner : {&stated.content.lo, &stated.content.hi})
      for (std::int64_t& coordinate : *corner) coordinate = in.number<std::int64_t>();
    bytes.assign(in.rest().begin(), in.rest().end());
    stated.bytes = bytes.size();
    stated.checksum = internal::checksum(bytes);
    stated.boxes = {stated.content};
  }
  internal::DirectoryRoot root;
  Bytes bytes;
  internal::DirectoryRecord stated;
};

void directoryGroup(Input input) {
  Taker in(input);
  OnePage page(in);
  page.stated.bytes_with_pages = page.bytes.size() + 1000;
  page.root.groups.assign(page.root.group_count(), page.stated);
  if (page.root.groups.empty()) return;
  for (const internal::DirectoryRecord& leaf : internal::decodeDirectoryGroup(page.root, 0, readerOf(page.bytes)))
    require(leaf.at + leaf.bytes <= page.stated.bytes_with_pages, "leaf pages lie in their group");
}

void directoryPage(Input input) {
  Taker in(input);
  OnePage page(in);
  page.root.groups.assign(page.root.group_count(), page.stated);
  if (page.root.groups.empty()) return;
  const internal::DirectoryGroup group(page.root.groupEnd(0), page.stated);
  const internal::DirectoryPage found = internal::decodeDirectoryPage(page.root, group, 0, readerOf(page.bytes));
  for (const TileEntry& entry : found.entries) require(entry.owned <= entry.stored, "counts agree");
}

// A root, a page of records and a page of names, in one file.
void cells(Input input) {
  Taker in(input);
  const std::uint32_t count = 1 + in.number<std::uint8_t>() % 3;
  const Bytes bytes(in.rest().begin(), in.rest().end());
  const internal::CellPage page = internal::decodeCellPage(bytes, count, bytes.size());
  require(page.records.size() == count && page.details.size() == count, "a record and a place for each cell");
}

void names(Input input) {
  Taker in(input);
  const std::size_t root_bytes = in.number<std::uint16_t>() % 512;
  const Bytes bytes(in.rest().begin(), in.rest().end());
  const ByteSpan root = ByteSpan(bytes).first(std::min(root_bytes, bytes.size()));
  const internal::CellsRoot found = internal::decodeCellsRoot(root, bytes.size());
  require(found.names.size() <= found.records.size() && found.names.size() == found.first_names.size(),
          "a first name for each page of names, and no more names than records");
  for (std::uint32_t page = 0; page < found.names.size(); ++page)
    for (const auto& [name, id] : internal::decodeNamePage(found, page, ByteSpan(bytes).subspan(root.size())))
      require(id < found.cells, "names are of cells");
}

void detail(Input input) {
  Taker in(input);
  const std::uint64_t samples = in.number<std::uint16_t>();
  const CellDetail found = internal::decodeDetail(in.rest(), samples);
  require(found.sample_ids.size() == samples, "an id for each sample");
  const Bytes again = internal::encodeDetail(found);
  require(internal::encodeDetail(internal::decodeDetail(again, samples)) == again, "a cell survives its bytes");
}

void patches(const Bytes& bytes) {
  const std::vector<internal::Patch> found = internal::decodePatches(bytes);
  require(internal::encodePatches(found) == bytes, "patches survive their bytes");
}

void landmarks(Bytes bytes) {
  seal(bytes, 24, 40, bytes.size());
  seal(bytes, 32, 0, 32);
  const Landmarks found = internal::decodeLandmarks(bytes);
  require(found.points.size() == found.segments.size() && found.points.size() == found.t.size(),
          "arrays of one length");
  require(internal::encodeLandmarks(found) == bytes, "landmarks survive their bytes");
}

void levels(Bytes bytes) {
  sealPages(bytes, 40, 8, 32, 160);
  const internal::LevelTable found = internal::decodeLevels(bytes);
  require(found.entries.size() == found.locations.size(), "a place for each tile");
  require(internal::encodeLevels(found).size() == bytes.size(), "a table survives its bytes");
}

}  // namespace

// The first byte chooses the binary file. Checksums are made valid, as a hostile writer would do.
void fuzzDirectory(Input input) {
  Taker in(input);
  const auto kind = in.number<std::uint8_t>() % 10;
  const Bytes bytes(in.rest().begin(), in.rest().end());
  try {
    if (kind == 0) oldDirectory(bytes);
    if (kind == 7) directoryRoot(bytes);
    if (kind == 8) directoryGroup(bytes);
    if (kind == 9) directoryPage(bytes);
    if (kind == 1) cells(bytes);
    if (kind == 2) detail(bytes);
    if (kind == 5) names(bytes);
    if (kind == 6) patches(bytes);
    if (kind == 3) landmarks(bytes);
    if (kind == 4) levels(bytes);
  } catch (const Damage& damage) {
    require(!damage.what.empty(), "damage is said in words");
  }
}

void fuzzManifest(Input input) {
  try {
    const internal::Manifest manifest = internal::decodeManifest(std::string(asText(input)));
    for (const SetFile& file : manifest.files) require(!file.name.empty(), "files have names");
  } catch (const Damage& damage) {
    require(!damage.what.empty(), "damage is said in words");
  }
  internal::isRevisionName(std::string(asText(input)));
}

}  // namespace filiform::fuzz
