#include "tools/lab/evaluate/trials/scenes.h"

#include "tools/synthetic/synthetic.h"

#include <algorithm>
#include <stdexcept>

namespace filiform::tools {

namespace {

std::uint32_t rankOf(const Cell& cell, const std::string& id) {
  const auto at = std::find(cell.sample_ids.begin(), cell.sample_ids.end(), std::stoll(id));
  if (at == cell.sample_ids.end()) throw std::logic_error("the route of a scene names a sample that is not there");
  return static_cast<std::uint32_t>(at - cell.sample_ids.begin());
}

}  // namespace

std::vector<CorpusCell> evaluationScenes(std::vector<std::string> kinds) {
  if (kinds.empty()) kinds = sceneKinds();
  std::vector<CorpusCell> scenes;
  for (const std::string& kind : kinds) {
    const std::string ends = sceneRoute(kind);
    SyntheticOptions options;
    options.kind = kind;
    CorpusCell scene;
    SyntheticCells(options).next(scene.cell);
    scene.cell.source = kind;
    const std::size_t colon = ends.find(':');
    DrawnRoute route;
    route.first = rankOf(scene.cell, ends.substr(0, colon));
    route.last = rankOf(scene.cell, ends.substr(colon + 1));
    route.key = scenes.size() + 1;
    scene.routes.push_back(route);
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

std::string sceneTitle(const CorpusCell& scene) {
  const std::string& kind = scene.cell.source;
  return kind.starts_with("scene") ? "scene " + kind.substr(5) : kind;
}

std::optional<PaperFigures> paperFigures(int scene, const std::string& method) {
  const int m = method == "basic" ? 0 : method == "shading" ? 1 : method == "force" ? 2 : -1;
  if (scene < 1 || scene > 3 || m < 0 || (scene == 3 && m == 0)) return std::nullopt;
  static constexpr PaperFigures kFigures[3][3] = {
      {{0.89, 1.43, 11.86, 1.81}, {1.31, 1.47, 4.46, 0.96}, {1.01, 1.91, 4.27, 0.97}},
      {{0.91, 1.15, 4.32, 1.03}, {1.21, 1.11, 2.01, 0.76}, {1.03, 3.56, 1.40, 0.53}},
      {{0, 0, 0, 0}, {1.42, 1.17, 7.24, 0.61}, {1.17, 4.34, 2.86, 0.46}}};
  return kFigures[scene - 1][m];
}

}  // namespace filiform::tools
