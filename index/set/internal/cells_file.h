// cells.bin: one record and one detail a cell. FORMAT.md specifies the bytes. Decoders throw Damage and never read past
// their input.
#pragma once

#include "index/set/internal/set_files.h"
#include "index/set/tile_store.h"

#include <vector>

namespace filiform::internal {

struct DetailPlace {
  std::uint64_t offset, bytes, checksum;
};
struct CellTable {
  std::vector<CellRecord> records;
  std::vector<DetailPlace> details;
  std::vector<std::uint32_t> by_name;  // cell ids, by name
};
// Encodes all but the details, which follow. Positions of details count from the first detail.
Bytes encodeCellTable(const std::vector<CellRecord>& records, const std::vector<std::uint64_t>& digests,
                      const std::vector<DetailPlace>& places);
inline constexpr std::size_t kCellsHeaderBytes = 56;
// Number of bytes for decodeCells(): header, records, name index and strings. Checks the header.
std::uint64_t cellTableBytes(ByteSpan header, std::uint64_t file_bytes);
CellTable decodeCells(ByteSpan table);
// The part of a cell's record that is needed to load its detail; the record is at cellRecordAt(). The records' checksum
// covers all records together, so here the detail's checksum shows damage.
struct DetailRecord {
  std::uint64_t samples, roots;
  DetailPlace place;
};
inline constexpr std::size_t kCellRecordBytes = 128;
constexpr std::uint64_t cellRecordAt(std::uint32_t cell) {
  return kCellsHeaderBytes + std::uint64_t{cell} * kCellRecordBytes;
}
DetailRecord decodeDetailRecord(ByteSpan record);
Bytes encodeDetail(const CellDetail& detail);
CellDetail decodeDetail(ByteSpan bytes, std::uint64_t samples);

}  // namespace filiform::internal
