#include "tools/words/segment_row.h"

#include "index/measure/cell_measures.h"
#include "tools/words/npy.h"

#include <cmath>

namespace filiform::tools {

nlohmann::ordered_json segmentRowJson(const SegmentRow& row) {
  const NearestResult& r = *row.result;
  nlohmann::ordered_json json{
      {"query", row.query},   {"rank", r.rank},  {"distance", r.distance_um}, {"x", r.p_W.x()},
      {"y", r.p_W.y()},       {"z", r.p_W.z()},  {"cell", *row.cell},         {"segment", r.segment.segment},
      {"sample", row.sample}, {"exact", r.exact}};
  if (row.tiles) json["tiles_read"] = *row.tiles;
  if (row.along) json["along"] = *row.along;
  json["type"] = row.look.type ? nlohmann::ordered_json(neuriteTypeName(*row.look.type)) : nlohmann::ordered_json();
  json["radius"] =
      std::isnan(row.look.radius_um) ? nlohmann::ordered_json() : nlohmann::ordered_json(row.look.radius_um);
  json["t"] = r.t;
  return json;
}

std::string segmentRecordType(bool along) {
  std::string type =
      "[('query', '<u4'), ('rank', '<u4'), ('distance', '<f8'), ('x', '<f8'), ('y', '<f8'), ('z', '<f8'), "
      "('cell', '<u4'), ('segment', '<u4'), ('sample', '<i8'), ('exact', '?')";
  return type + (along ? ", ('along', '<f8')" : "") + ", ('type', '<i4'), ('radius', '<f8'), ('t', '<f8')]";
}

void appendSegmentRecord(std::string& bytes, const SegmentRow& row) {
  const NearestResult& r = *row.result;
  appendValue(bytes, static_cast<std::uint32_t>(row.query));
  appendValue(bytes, r.rank);
  appendValue(bytes, r.distance_um);
  for (int axis = 0; axis < 3; ++axis) appendValue(bytes, static_cast<double>(r.p_W[axis]));
  appendValue(bytes, r.segment.cell);
  appendValue(bytes, r.segment.segment);
  appendValue(bytes, row.sample);
  appendValue(bytes, static_cast<char>(r.exact ? 1 : 0));
  if (row.along) appendValue(bytes, *row.along);
  appendValue(bytes, row.look.type ? std::int32_t{*row.look.type} : -1);
  appendValue(bytes, row.look.radius_um);
  appendValue(bytes, r.t);
}

}  // namespace filiform::tools
