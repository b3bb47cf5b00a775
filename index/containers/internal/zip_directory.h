// Reads the central directory of a zip archive. libzip does not tell where an entry's bytes lie, or whether a file is
// truncated or not an archive. Thread rule: pure functions, any thread.
#pragma once

#include "index/reports/input_report.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace filiform::internal {

struct ZipEntry {
  std::string name;  // raw bytes, or the name of the field Info-ZIP Unicode Path (APPNOTE 4.6.9) if it is valid
  std::uint16_t name_bytes = 0;  // of the raw name
  std::uint16_t flags = 0;
  std::uint16_t method = 0;
  std::uint32_t crc32 = 0;
  std::uint32_t attributes = 0;  // external
  std::uint64_t packed_bytes = 0, bytes = 0;
  std::uint64_t header_at = 0;  // local header, from the start of the archive
};

struct ZipDirectory {
  std::optional<InputCode> refusal;  // E_ZIP_TRUNCATED, E_ZIP_FORMAT or E_ZIP_OVERLAP: `entries` is then empty
  std::uint64_t file_bytes = 0;
  std::uint64_t archive_at = 0;  // bytes before the archive, as in self-extracting files
  std::uint64_t digest = 0;      // XXH3 of the directory's bytes: names, sizes and checksums of all entries
  std::vector<ZipEntry> entries;
};

// Reads the directory. A signature inside the archive comment is not taken for the end record: the directory must be
// valid and end where the record says. Throws IoError if the file cannot be read. O(entries log entries).
ZipDirectory readZipDirectory(const std::string& path);

}  // namespace filiform::internal
