#include "index/file/internal/set_files.h"

#include <algorithm>
#include <cstdio>

namespace filiform::internal {

std::string packFile(std::uint32_t pack) {
  char name[32];
  std::snprintf(name, sizeof name, "tiles-%05u.pack", pack);
  return name;
}

bool isPackFile(const std::string& name) { return name.starts_with("tiles-") && name.ends_with(".pack"); }

std::string sectionFile(const std::string& section) { return "section-" + section + ".bin"; }

std::string sectionOf(const std::string& file) {
  if (file.size() < 13 || file.size() > 12 + 64 || !file.starts_with("section-") || !file.ends_with(".bin")) return {};
  const std::string name = file.substr(8, file.size() - 12);
  return name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == std::string::npos ? name : "";
}

void throwOtherVersion(std::uint64_t offset, const std::string& version, bool older) {
  throw OtherVersion{{offset, "format version " + version + ", this program reads " + std::to_string(kOldestVersion) +
                                  " to " + std::to_string(kFormatVersion)},
                     version,
                     older};
}

void writeMagic(ByteWriter& out, std::string_view magic) {
  out.text(magic);
  out.u32(kFormatVersion);
}

std::uint32_t checkMagic(ByteReader& in, std::string_view magic) {
  const ByteSpan found = in.take(magic.size());
  in.require(std::equal(found.begin(), found.end(), magic.begin()), "not a file of this kind");
  const std::uint32_t version = in.u32();
  if (version < kOldestVersion || version > kFormatVersion)
    throwOtherVersion(magic.size(), std::to_string(version), version < kOldestVersion);
  return version;
}

Bytes packHeader(std::string_view magic, std::uint32_t pack) {
  ByteWriter out;
  writeMagic(out, magic);
  out.u32(pack);
  return out.take();
}
Bytes packHeader(std::uint32_t pack) { return packHeader("FILIPACK", pack); }

}  // namespace filiform::internal
