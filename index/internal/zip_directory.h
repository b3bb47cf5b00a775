// The central directory of a zip archive, read on its own: libzip tells neither where an entry's bytes lie nor whether
// an archive is cut short or none at all. Thread-compatible functions.
#pragma once

#include "index/input_report.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform::internal {

struct ZipEntry {
  std::string name;  // raw bytes
  std::uint16_t flags = 0;
  std::uint16_t method = 0;
  std::uint32_t crc32 = 0;
  std::uint32_t attributes = 0;  // external
  std::uint64_t packed_bytes = 0, bytes = 0;
  std::uint64_t header_at = 0;  // local header, from the start of the archive
};

struct ZipDirectory {
  std::optional<InputCode> refusal;  // E_ZIP_TRUNCATED, E_ZIP_FORMAT or E_ZIP_OVERLAP; then there are no entries
  std::uint64_t file_bytes = 0;
  std::uint64_t archive_at = 0;  // bytes before the archive proper, as in self-extracting files
  std::uint64_t digest = 0;      // XXH3 of the directory's bytes: names, sizes and checksums of all entries
  std::vector<ZipEntry> entries;
};

// Signatures inside the archive comment are told from the real end record: the directory must parse in full and end
// where the record says. Throws IoError when the file cannot be read. O(entries log entries).
ZipDirectory readZipDirectory(const std::string& path);

}  // namespace filiform::internal
