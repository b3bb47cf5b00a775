#include "index/build/ingest.h"

#include "index/build/internal/heap.h"
#include "index/build/internal/make_set.h"
#include "index/build/internal/rank_packs.h"

#include <optional>

namespace filiform {
namespace {

using internal::ByteSpan;
using Purpose = internal::SetFolder::Purpose;

// `folder`: of rank 0, which writes what there is once, and publishes.
IngestResult ingestInto(CellStream& stream, const std::string& building, std::optional<internal::SetFolder>& folder,
                        const IngestOptions& options) {
  Ranks& ranks = *options.ranks;
  const unsigned threads = internal::checkedThreads(options);
  internal::unmapLargeBlocksWhenFreed();
  internal::Tiler tiler(internal::tilerOptionsOf(options, threads, building, internal::stepOf(options)));
  tiler.read(stream);
  const Provenance provenance = options.provenance ? options.provenance() : Provenance{};
  tiler.cut();
  const auto leaves = static_cast<std::uint32_t>(tiler.leaves().size());
  internal::TilePacker::Options packing = internal::packerOptionsOf(options, threads, building, tiler);
  const auto packsOf = [&](internal::TilePacker& packer) {
    return internal::RankPacks{ranks,  packer,        building, options.pack_bytes, internal::encodedMemory(options),
                               leaves, options.levels};
  };
  if (!folder) {
    std::optional<internal::RankPacker> together;
    packing.hold = true;
    internal::TilePacker packer(
        std::move(packing), [&](const TileEntry& entry, std::uint32_t leaf, ByteSpan geometry, ByteSpan appearance) {
          together->add(entry, leaf, geometry, appearance);
        });
    tiler.tiles(packer);
    together.emplace(packsOf(packer));
    together->run();
    ranks.share({});  // rank 0 publishes before
    return {};
  }
  TileWriter writer(building, Grid(options.quantum_exponent), options.capacity, options.pack_bytes, options.page_tiles);
  writer.reserve(leaves + std::size_t{1});
  auto packer = std::make_unique<internal::TilePacker>(
      std::move(packing), [&](const TileEntry& entry, std::uint32_t leaf, ByteSpan geometry, ByteSpan appearance) {
        writer.add(entry, geometry, appearance, leaf == leaves);
      });
  tiler.tiles(*packer);
  internal::packTogether(packsOf(*packer), writer);
  IngestResult result = internal::completeSet(*folder, options, tiler, std::move(packer), writer, &provenance);
  ranks.share({});
  return result;
}

IngestResult ingestTogether(CellStream& stream, const std::string& path, const IngestOptions& options) {
  Ranks& ranks = *options.ranks;
  std::optional<internal::SetFolder> folder;
  if (ranks.rank() == 0) folder.emplace(path, options.force ? Purpose::replace : Purpose::create);
  const std::string own = folder ? folder->building() : std::string();
  const Ranks::Bytes shared = ranks.share({reinterpret_cast<const std::uint8_t*>(own.data()), own.size()}).front();
  const std::string building(shared.begin(), shared.end());
  ranks.setFolder(building);
  try {
    return ingestInto(stream, building, folder, options);
  } catch (const std::exception& error) {
    ranks.fail(error);  // before the folder is removed: other ranks may be writing there
    throw;
  }
}

}  // namespace

IngestResult ingest(CellStream& stream, const std::string& path, const IngestOptions& options) {
  internal::checkedThreads(options);
  if (options.ranks != nullptr && options.ranks->count() > 1)
    return ingestTogether(stream, internal::folderName(path), options);
  internal::SetFolder folder(internal::folderName(path), options.force ? Purpose::replace : Purpose::create);
  return internal::makeSet(folder, options, [&](internal::Tiler& tiler) { tiler.read(stream); });
}

}  // namespace filiform
