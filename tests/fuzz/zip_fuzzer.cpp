#include "index/containers/internal/archive.h"
#include "index/errors.h"
#include "index/text.h"
#include "tests/fuzz/fuzz_bytes.h"

namespace filiform::fuzz {

void fuzzZip(Input input) {
  static MemoryFile file;
  file.hold(input);
  try {
    Archive archive(file.path());
    Archive::Reader reader(archive);
    for (const ArchiveEntry& entry : archive.entries()) {
      if (entry.skipped) continue;
      std::uint64_t got = 0;
      const auto refused = reader.read(entry, [&](std::string_view block) {
        got += block.size();
        require(got <= entry.bytes, "never more than the declared size");
      });
      require(refused || got == entry.bytes, "what is not refused is whole");
    }
  } catch (const InputError&) {
  } catch (const IoError&) {
  }
}

}  // namespace filiform::fuzz
