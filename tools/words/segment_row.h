// SegmentRow: one segment that a query found, as JSON or as a record of an .npy array. Functions without state.
#pragma once

#include "index/measure/segment_looks.h"
#include "index/query/nearest.h"

#include <cstdint>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

namespace filiform::tools {

struct SegmentRow {
  std::size_t query;  // rank of the point
  const NearestResult* result;
  const std::string* cell;           // name
  std::int64_t sample;               // id of the segment's child
  std::optional<double> along = {};  // along a ray
  SegmentLook look = {};
  std::optional<std::uint32_t> tiles = {};  // that this query reads if none is in memory; given, JSON has them
};

nlohmann::ordered_json segmentRowJson(const SegmentRow& row);

// The dtype of a record, as Python writes it: query, rank, distance, x, y, z, cell (its id), segment, sample, exact;
// along for a ray; type (its code, -1 if not read), radius (NaN: unknown), t.
std::string segmentRecordType(bool along);
// Appends one record, little-endian, packed.
void appendSegmentRecord(std::string& bytes, const SegmentRow& row);

}  // namespace filiform::tools
