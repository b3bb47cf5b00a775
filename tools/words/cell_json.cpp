#include "tools/words/cell_json.h"

#include "index/query/cell_graph.h"

namespace filiform::tools {

std::uint64_t loopsOf(const CellRecord& cell) { return hasLoops(cell) ? cell.segments + cell.roots - cell.samples : 0; }

nlohmann::ordered_json attributesJson(const std::vector<CellAttribute>& attributes) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const CellAttribute& attribute : attributes) {
    nlohmann::ordered_json& value = json[attribute.name];
    if (const auto* const text = std::get_if<std::string>(&attribute.value)) value = *text;
    if (const auto* const integer = std::get_if<std::int64_t>(&attribute.value)) value = *integer;
    if (const auto* const real = std::get_if<double>(&attribute.value)) value = *real;
  }
  return json;
}

nlohmann::ordered_json cellJson(std::uint32_t id, const CellRecord& cell, const Grid& grid,
                                const std::optional<double>& length_um) {
  nlohmann::ordered_json json{{"id", id},
                              {"name", cell.name},
                              {"source", cell.source},
                              {"samples", cell.samples},
                              {"segments", cell.segments},
                              {"isolated", cell.isolated},
                              {"roots", cell.roots},
                              {"loops", loopsOf(cell)},
                              {"length_um", nullptr},
                              {"box_um", nullptr}};
  if (length_um) json["length_um"] = *length_um;
  if (!cell.bounds.empty())
    for (const GridPoint& corner : {cell.bounds.lo, cell.bounds.hi}) {
      const Vector3d p_W = grid.toWorld(corner);
      json["box_um"].push_back({p_W.x(), p_W.y(), p_W.z()});
    }
  return json;
}

}  // namespace filiform::tools
