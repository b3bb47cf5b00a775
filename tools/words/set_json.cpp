#include "tools/words/set_json.h"

#include "index/levels/levels.h"
#include "index/set/tile_set.h"
#include "index/streaming/residency.h"

namespace filiform::tools {

std::uint64_t levelSegments(const Levels& levels) {
  std::uint64_t segments = 0;
  for (LevelId l = 0; l < levels.size(); ++l) segments += levels.entry(l).segments;
  return segments;
}

LostInputs lostInputs(const TileSet& set) {
  LostInputs lost;
  if (set.refused() + set.skipped() == 0) return lost;
  const auto provenance = nlohmann::json::parse(set.readProvenance());
  for (const auto& [name, inputs] : {std::pair("refused", &lost.refused), {"skipped", &lost.skipped}})
    for (const auto& input : provenance.value(name, nlohmann::json::array()))
      inputs->emplace_back(input.at("name").get<std::string>(), input.at("reason").get<std::string>());
  return lost;
}

nlohmann::ordered_json setJson(const TileSet& set, const Levels* levels) {
  const SetCounts& n = set.counts();
  nlohmann::ordered_json info{{"cells", n.cells},
                              {"samples", n.samples},
                              {"segments", n.segments},
                              {"isolated", n.isolated},
                              {"roots", n.roots},
                              {"tiles", n.tiles},
                              {"stored_segments", n.stored_segments},
                              {"bytes", set.bytes()},
                              {"decoded_bytes", n.decoded_bytes},
                              {"quantum_um", set.grid().quantum_um()},
                              {"capacity", set.capacity()},
                              {"refused", set.refused()},
                              {"level_tiles", levels ? levels->size() : 0},
                              {"level_bytes", levels ? levels->bytes() : 0},
                              {"revision", set.revision()},
                              {"box_um", nullptr},
                              {"ghosts", n.stored_segments - n.segments - n.isolated},
                              {"level_segments", levels ? levelSegments(*levels) : 0},
                              {"coarsest_level", nullptr},
                              {"smallest_budget_bytes", Residency::floorBytes(set)},
                              {"refused_inputs", nlohmann::ordered_json::array()},
                              {"skipped", set.skipped()},
                              {"skipped_inputs", nlohmann::ordered_json::array()}};
  if (!set.bounds().empty())
    for (const GridPoint& corner : {set.bounds().lo, set.bounds().hi}) {
      const Vector3d p_W = set.grid().toWorld(corner);
      info["box_um"].push_back({p_W.x(), p_W.y(), p_W.z()});
    }
  if (levels && levels->size() > 0) {
    const LevelEntry& top = levels->entry(0);
    info["coarsest_level"] = {{"segments", top.segments},
                              {"error_um", top.error_um},
                              {"hidden", top.hidden},
                              {"of", top.hidden + top.represented}};
  }
  const LostInputs lost = lostInputs(set);
  for (const auto& [name, reason] : lost.refused)
    info["refused_inputs"].push_back({{"name", name}, {"reason", reason}});
  for (const auto& [name, reason] : lost.skipped)
    info["skipped_inputs"].push_back({{"name", name}, {"reason", reason}});
  return info;
}

}  // namespace filiform::tools
