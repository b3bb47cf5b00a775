#include "index/containers/internal/gunzip.h"
#include "index/containers/internal/tar_archive.h"
#include "index/errors.h"
#include "tests/fuzz/fuzz_bytes.h"

#include <algorithm>

namespace filiform::fuzz {

// The first byte chooses: gzip data in blocks of a size, a tar archive, or a tar archive in gzip.
void fuzzPacked(Input input) {
  Taker in(input);
  const auto choice = in.number<std::uint8_t>();
  const Input rest = in.rest();
  if (choice % 3 == 0) {
    const std::string_view bytes = asText(rest);
    std::string whole, parts;
    const auto wrong = internal::gunzip(bytes, 1 << 20, whole);
    internal::Gunzip gzip;
    std::optional<InputCode> wrong_in_parts;
    const std::size_t step = choice / 3 + 1;
    for (std::size_t at = 0; at < bytes.size() && !wrong_in_parts && parts.size() <= 1 << 20; at += step)
      wrong_in_parts = gzip.feed(bytes.substr(at, step), [&](std::string_view block) { parts += block; });
    if (!wrong_in_parts) wrong_in_parts = gzip.finish();
    if (!wrong) require(!wrong_in_parts && whole == parts, "the same content for any division into blocks");
    return;
  }
  static MemoryFile file;
  file.hold(rest);
  try {
    const TarArchive tar(file.path(), choice % 3 == 2);
    const auto reader = tar.reader();
    for (const ArchiveEntry& entry : tar.entries()) {
      if (entry.skipped) continue;
      std::uint64_t got = 0;
      const auto refused = reader->read(entry, [&](std::string_view block) { got += block.size(); });
      require(got <= entry.bytes && (refused || got == entry.bytes), "what is not refused is whole");
    }
  } catch (const IoError&) {
  }
}

}  // namespace filiform::fuzz
