#include "index/build/ingest.h"

#include "index/build/internal/make_set.h"

namespace filiform {

IngestResult ingest(CellStream& stream, const std::string& path, const IngestOptions& options) {
  using Purpose = internal::SetFolder::Purpose;
  internal::checkedThreads(options);
  internal::SetFolder folder(internal::folderName(path), options.force ? Purpose::replace : Purpose::create);
  return internal::makeSet(folder, options, [&](internal::Tiler& tiler) { tiler.read(stream); });
}

}  // namespace filiform
