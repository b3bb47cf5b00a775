// PackWriter: appends encoded tiles to numbered packs.
#pragma once

#include "index/file/internal/output_file.h"
#include "index/file/internal/set_files.h"
#include "index/set/tile_set.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace filiform::internal {

// Thread rule: thread-compatible. Every member throws IoError.
class PackWriter {
 public:
  // The name and the first bytes of a pack.
  struct Kind {
    std::string (*file)(std::uint32_t pack);
    Bytes (*header)(std::uint32_t pack);
  };

  // Writes packs into an existing folder. A pack ends before a tile that would make it larger than `pack_bytes`.
  PackWriter(std::string folder, const Kind& kind, std::uint64_t pack_bytes)
      : folder_(std::move(folder)), kind_(kind), pack_bytes_(pack_bytes) {}
  // Numbers packs from `first` on. Call it before add().
  void numberFrom(std::uint32_t first) { packs_ = first; }

  // Appends a tile. Throws InputError with the message `too_large` if a part takes more than 4 GiB.
  TileLocation add(ByteSpan geometry, ByteSpan appearance, const char* too_large);
  // Ends the current pack. Returns the packs finished since the last call.
  std::vector<SetFile> close();

 private:
  void endPack();

  std::string folder_;
  Kind kind_;
  std::uint64_t pack_bytes_;
  std::unique_ptr<OutputFile> pack_;
  std::uint32_t packs_ = 0;
  std::vector<SetFile> finished_;
};

}  // namespace filiform::internal
