#include "index/set/internal/directory_reader.h"

#include <stdexcept>
#include <utility>

namespace filiform::internal {
namespace {

// An inner page comes with its leaf pages in one read if all of them take no more bytes.
constexpr std::uint64_t kMostReadTogether = std::uint64_t{32} << 10;

}  // namespace

DirectoryReader::DirectoryReader(const Revision& revision) : revision_(revision) {
  const Manifest& manifest = revision.manifest();
  const std::string manifest_name = revision.describe(kManifestFile);
  const SetFile& file = revision.file(kDirectoryFile);
  root_ = decoded(manifest_name, 0,
                  [&] { return decodeDirectoryRoot(manifest.directory_root, manifest.version, file.bytes); });
  if (root_.tiles != manifest.counts.tiles) throw CorruptSet(manifest_name, 0, "its number of tiles is wrong");
  for (const SetFile* pack = nullptr;
       (pack = revision.find(packFile(static_cast<std::uint32_t>(pack_bytes_.size())))) != nullptr;) {
    pack_bytes_.push_back(pack->bytes);
    pack_names_.push_back(revision.describe(pack->name));
  }
  groups_ = std::make_unique<ReadOnce<DirectoryGroup>[]>(root_.groups.size());
  pages_ = std::make_unique<ReadOnce<DirectoryPage>[]>(root_.page_count());
  pages_unknown_ = root_.page_count();
  std::vector<MortonKey> lows;
  for (std::uint32_t g = 0; g < root_.groups.size() && root_.pageBegin(root_.groupBegin(g)) < root_.leaf_count(); ++g)
    lows.push_back(root_.groups[g].low);
  leaves_ = LeafIndex(std::move(lows), {root_.page_tiles, root_.group_pages, root_.leaf_count()});
}

template <typename Decode>
auto DirectoryReader::readDirectory(Decode decode) const {
  std::uint64_t at = 0, size = 0;  // of the last read
  const ReadPart read = [&](std::uint64_t offset, std::uint64_t bytes) {
    at = offset, size = bytes;
    return revision_.read(kDirectoryFile, offset, bytes);
  };
  for (bool again = false;; again = true) {
    try {
      return decoded(revision_.describe(kDirectoryFile), 0, [&] { return decode(read); });
    } catch (const CorruptSet&) {
      if (again || !revision_.discard(kDirectoryFile, at, size)) throw;
    }
  }
}

const DirectoryGroup& DirectoryReader::group(std::uint32_t number) const {
  if (const DirectoryGroup* const known = groups_[number].known()) return *known;
  const DirectoryRecord& stated = root_.groups[number];
  const bool together = stated.bytes_with_pages > 0 && stated.bytes_with_pages <= kMostReadTogether;
  const std::uint32_t begin = root_.groupBegin(number);
  std::vector<std::unique_ptr<DirectoryPage>> pages;
  auto found = std::make_unique<DirectoryGroup>(readDirectory([&](const ReadPart& read) {
    if (!together) return decodeDirectoryGroup(root_, number, read);
    const Bytes whole = read(stated.at, stated.bytes_with_pages);
    const ReadPart part = [&](std::uint64_t offset, std::uint64_t bytes) {
      const auto from = whole.begin() + static_cast<std::ptrdiff_t>(offset - stated.at);
      return Bytes(from, from + static_cast<std::ptrdiff_t>(bytes));
    };
    DirectoryGroup group = decodeDirectoryGroup(root_, number, part);
    pages.clear();
    for (std::uint32_t i = 0; i < group.size(); ++i)
      pages.push_back(std::make_unique<DirectoryPage>(decodeDirectoryPage(root_, group, begin + i, part)));
    return group;
  }));
  std::vector<MortonKey> lows;
  for (std::uint32_t i = 0; i < found->size() && root_.pageBegin(begin + i) < root_.leaf_count(); ++i)
    lows.push_back((*found)[i].low);
  {
    const std::lock_guard lock(mutex_);
    if (groups_[number].keep(std::move(found)) && !lows.empty()) leaves_.addGroup(number, std::move(lows));
  }
  for (std::uint32_t i = 0; i < pages.size(); ++i) keepPage(begin + i, std::move(pages[i]));
  return *groups_[number].known();
}

const DirectoryPage& DirectoryReader::page(TileId tile) const {
  if (tile >= root_.tiles) throw std::out_of_range("the tile does not exist");
  const std::uint32_t number = tile / root_.page_tiles;
  const DirectoryPage* const known = pages_[number].known();
  return known != nullptr ? *known : readPage(number);
}

void DirectoryReader::checkLocation(TileId tile, const TileLocation& at) const {
  const std::uint64_t bytes_needed = std::uint64_t{at.geometry_bytes} + at.appearance_bytes;
  if (tile < root_.tiles && at.pack < pack_bytes_.size() && at.offset <= pack_bytes_[at.pack] &&
      bytes_needed <= pack_bytes_[at.pack] - at.offset)
    return;
  std::string what = "tile " + std::to_string(tile);
  what += " lies outside the packs";
  throw CorruptSet(revision_.describe(kDirectoryFile), 0, what);
}

const DirectoryPage& DirectoryReader::readPage(std::uint32_t number) const {
  const DirectoryGroup& listed = group(number / root_.group_pages);
  if (pages_[number].known() == nullptr)
    keepPage(number, std::make_unique<DirectoryPage>(readDirectory(
                         [&](const ReadPart& read) { return decodeDirectoryPage(root_, listed, number, read); })));
  return *pages_[number].known();
}

void DirectoryReader::keepPage(std::uint32_t number, std::unique_ptr<DirectoryPage> found) const {
  const TileId begin = root_.pageBegin(number);
  for (std::size_t t = 0; t < found->locations.size(); ++t)
    checkLocation(begin + static_cast<TileId>(t), found->locations[t]);
  std::vector<BlockKey> keys;
  keys.reserve(found->entries.size());
  for (std::size_t t = 0; t < found->entries.size() && begin + t < root_.leaf_count(); ++t)
    keys.push_back(found->entries[t].key);
  const std::lock_guard lock(mutex_);
  if (pages_[number].keep(std::move(found))) {  // before leaves_: who finds a page there can take its entries
    if (!keys.empty()) leaves_.add(number, std::move(keys));
    pages_unknown_.fetch_sub(1, std::memory_order_release);
  }
}

const DirectoryRecord& DirectoryReader::record(std::uint32_t page) const {
  if (page >= root_.page_count()) throw std::out_of_range("the page does not exist");
  return group(page / root_.group_pages)[page % root_.group_pages];
}

TileId DirectoryReader::home(const GridPoint& p) const {
  const std::size_t in_group = leaves_.groupOf(p);
  if (in_group == LeafIndex::kNone) return kNoTile;
  group(static_cast<std::uint32_t>(in_group));
  const std::size_t number = leaves_.pageOf(p);
  if (number == LeafIndex::kNone) return kNoTile;
  if (!leaves_.knows(number)) readPage(static_cast<std::uint32_t>(number));
  return leaves_.home(p);
}

void DirectoryReader::knowHomes(const Tile& tile) const {
  if (pages_unknown_.load(std::memory_order_acquire) == 0 || tile.node_count() == 0) return;
  // Keys increase with each coordinate: all nodes lie in the pages between the two corners of their box.
  constexpr std::int64_t kLast = (std::int64_t{1} << (kMortonAxisBits - 1)) - 1;
  const GridPoint far = tile.origin().array() + ((std::int64_t{1} << tile.offset_bits()) - 1);
  const std::size_t first = leaves_.pageOf(tile.origin()), last = leaves_.pageOf(far.cwiseMin(kLast));
  bool all = first != LeafIndex::kNone && last != LeafIndex::kNone;
  for (std::size_t number = first; all && number <= last; ++number) all = leaves_.knows(number);
  if (all) return;
  for (std::uint32_t node = 0; node < tile.node_count(); ++node)
    if (!tile.isHome(node)) home(tile.gridPoint(node));
}

}  // namespace filiform::internal
