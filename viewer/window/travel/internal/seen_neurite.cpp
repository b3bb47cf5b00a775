#include "viewer/window/travel/internal/seen_neurite.h"

#include "index/measure/cell_measures.h"
#include "index/text.h"
#include "viewer/window/settings/internal/text_format.h"

#include <cmath>
#include <vector>

namespace filiform::internal {

std::string kindText(const CellWalk& walk, const CellWalk::Spot& spot) {
  const CellGraph& graph = walk.graph();
  const std::uint32_t root = walk.root(spot);
  const bool has_soma = !graph.types.empty() && graph.types[root] == kSomaType;
  std::string text;
  if (!graph.types.empty()) {
    const std::uint16_t type = graph.types[spot.child];
    text = neuriteTypeName(type) + (type == 3 || type == 4 ? " dendrite, " : ", ");
  }
  return text + format("%.4g \u00b5m from the ", walk.toRoot_um(spot)) + (has_soma ? "soma" : "root");
}

std::optional<std::uint32_t> farthestTipOfKind(const CellWalk& walk, const CellWalk::Spot& spot) {
  const std::vector<std::uint16_t>& types = walk.graph().types;
  const std::vector<double> lengths_um = walk.paths().lengths_um(spot);
  std::optional<std::uint32_t> tip;
  for (std::uint32_t node = 0; node < walk.samples(); ++node) {
    if (!std::isfinite(lengths_um[node]) || lengths_um[node] <= 0 || !walk.paths().isTip(node)) continue;
    if (!types.empty() && types[node] != types[spot.child]) continue;
    if (!tip || lengths_um[node] > lengths_um[*tip]) tip = node;
  }
  return tip;
}

double radiusAt_um(const CellWalk& walk, const CellWalk::Spot& spot) {
  const std::vector<float>& radii_um = walk.graph().radii_um;
  if (radii_um.empty()) return 0;
  const double child = radii_um[spot.child], parent = radii_um[spot.parent], um = child + spot.t * (parent - child);
  return um > 0 ? um : child > 0 ? child : 0;  // NaN: not known
}

std::string nameText(const SeenNeurite& seen) {
  return inShort(seen.cell) + (seen.sample ? ":" + std::to_string(*seen.sample) : "");
}

std::string placeText(const SeenNeurite& seen) {
  const Vector3d& p = seen.place.p_W;
  return format("%.2f %.2f %.2f \u00b5m", p.x(), p.y(), p.z());
}

}  // namespace filiform::internal
