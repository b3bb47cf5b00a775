#include "index/verify/set_digest.h"

#include "index/file/internal/sha256.h"

namespace filiform {

std::string setDigest(const TileSet& set, const std::function<void(std::uint64_t)>& step) {
  internal::Sha256 digest;
  const std::string& manifest = set.manifest();
  digest.add({reinterpret_cast<const std::uint8_t*>(manifest.data()), manifest.size()});
  std::uint64_t done = manifest.size();
  for (const SetFile& file : set.files()) {
    step(done);
    set.checkFile(file, [&](std::span<const std::uint8_t> bytes) { digest.add(bytes); });
    done += file.bytes;
  }
  return digest.value();
}

}  // namespace filiform
