// The inputs of a tar archive, plain or packed by gzip. libarchive reads the headers; nothing is extracted, and entry
// names are only labels.
//
// A plain archive is read in place. The inputs of a packed one are copied to a temporary file (packed_spool.h) while it
// is listed, since gzip data can only be read from the start. Thread rule: as Container.
#pragma once

#include "index/containers/internal/container.h"

#include <functional>
#include <memory>
#include <string>

namespace filiform {

namespace internal {
class PackedSpool;
}

class TarArchive final : public Container {
 public:
  // Lists the archive: reads all of it if `packed`, else its headers. Its entries are those that
  // internal::entryOfName() gives, in the order of the archive. Refusals: E_ZIP_TRUNCATED if it is cut short,
  // E_ZIP_CRC and E_ZIP_FORMAT for damage, E_ZIP_NO_SWC. `progress` is called after each block. Throws IoError, and
  // what `progress` throws.
  TarArchive(std::string path, bool packed, const std::function<void()>& progress = {});
  ~TarArchive() override;

  std::unique_ptr<Reader> reader() const override;

 private:
  class Listing;
  void shareFileBytes();

  std::string path_;
  std::unique_ptr<internal::PackedSpool> spool_;  // of a packed archive
};

}  // namespace filiform
