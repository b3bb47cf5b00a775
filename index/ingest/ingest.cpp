#include "index/ingest/ingest.h"

#include "index/ingest/internal/make_set.h"

#include <optional>

namespace filiform {
namespace {

using Purpose = internal::SetFolder::Purpose;

IngestResult ingestTogether(CellStream& stream, const std::string& path, const IngestOptions& options) {
  Ranks& ranks = *options.ranks;
  std::optional<internal::SetFolder> folder;
  if (ranks.rank() == 0) folder.emplace(path, options.force ? Purpose::replace : Purpose::create);
  const std::string own = folder ? folder->building() : std::string();
  const Ranks::Bytes shared = ranks.share({reinterpret_cast<const std::uint8_t*>(own.data()), own.size()}).front();
  const std::string building(shared.begin(), shared.end());
  ranks.setFolder(building);
  try {
    return internal::makeSet(folder ? &*folder : nullptr, building, options,
                             [&](internal::Tiler& tiler) { tiler.read(stream); });
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
  return internal::makeSet(&folder, folder.building(), options, [&](internal::Tiler& tiler) { tiler.read(stream); });
}

}  // namespace filiform
