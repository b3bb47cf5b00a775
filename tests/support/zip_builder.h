// Builds zip archives byte by byte, so that any field may be wrong. Stored entries only; thread-compatible.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform::test {

struct ZipMember {
  std::string name;
  std::string content;
  std::optional<std::uint32_t> crc32;      // instead of the true one
  std::optional<std::uint32_t> bytes;      // declared size instead of the true one
  std::optional<std::uint32_t> header_at;  // instead of the true offset of the local header
  std::uint16_t flags = 0;
  std::uint16_t method = 0;
  std::uint32_t attributes = 0;
  std::string extra = {};  // extra field, of the local header and of the directory
};

inline ZipMember zipMember(const std::string& name, const std::string& content) {
  ZipMember member;
  member.name = name;
  member.content = content;
  return member;
}

// The extra field Info-ZIP Unicode Path: `name` stands for `raw_name`.
std::string unicodePath(const std::string& raw_name, const std::string& name);

inline constexpr std::uint32_t kSymbolicLinkAttributes = 0120777u << 16;

// Returns the bytes of the archive. `prefix` comes first and does not count in the offsets.
std::string buildZip(const std::vector<ZipMember>& members, const std::string& comment = "",
                     const std::string& prefix = "");

// Writes the same members by libzip to the file `path`; those of more than 64 bytes are deflated.
void writeDeflatedZip(const std::string& path, const std::vector<ZipMember>& members);

}  // namespace filiform::test
