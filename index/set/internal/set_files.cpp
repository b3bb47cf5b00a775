#include "index/set/internal/set_files.h"

#include <algorithm>
#include <cstdio>

namespace filiform::internal {

std::string packFile(std::uint32_t pack) {
  char name[32];
  std::snprintf(name, sizeof name, "tiles-%05u.pack", pack);
  return name;
}

void writeMagic(ByteWriter& out, std::string_view magic) {
  out.text(magic);
  out.u32(kFormatVersion);
}

void checkMagic(ByteReader& in, std::string_view magic) {
  const ByteSpan found = in.take(magic.size());
  in.require(std::equal(found.begin(), found.end(), magic.begin()), "not a file of this kind");
  const std::uint32_t version = in.u32();
  if (version != kFormatVersion)
    in.fail("format version " + std::to_string(version) + ", this program reads " + std::to_string(kFormatVersion));
}

Bytes packHeader(std::string_view magic, std::uint32_t pack) {
  ByteWriter out;
  writeMagic(out, magic);
  out.u32(pack);
  return out.take();
}
Bytes packHeader(std::uint32_t pack) { return packHeader("FILIPACK", pack); }

}  // namespace filiform::internal
