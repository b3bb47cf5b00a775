#include "tools/lab/bench/index/extreme_cells.h"

#include <random>

namespace filiform::tools {

Cell emptyCell(const std::string& source) {
  Cell cell;
  cell.source = source;
  return cell;
}

void addSample(Cell& cell, const Vector3d& p_W, std::uint32_t parent) {
  cell.sample_ids.push_back(static_cast<std::int64_t>(cell.samples()) + 1);
  cell.positions_um.push_back(p_W);
  cell.parents.push_back(parent);
  cell.radii_um.push_back(0.5f);
  cell.types.push_back(3);
}

Cell hubCell(std::size_t branches, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto um = [&] { return 40 * (static_cast<double>(random() >> 11) * 0x1p-53) - 20; };
  Cell cell = emptyCell("hub.swc");
  addSample(cell, Vector3d::Zero(), kNoParent);
  for (std::size_t i = 0; i < branches; ++i) {
    const double x_um = um(), y_um = um(), z_um = um();
    addSample(cell, Vector3d(x_um, y_um, z_um), 0);
  }
  return cell;
}

Cell combCell(std::size_t twigs) {
  Cell cell = emptyCell("comb.swc");
  addSample(cell, Vector3d::Zero(), kNoParent);
  std::uint32_t spine = 0;
  for (std::size_t i = 1; i <= twigs; ++i) {
    const auto x_um = static_cast<double>(i);
    addSample(cell, Vector3d(x_um, 0, 0), spine);
    spine = static_cast<std::uint32_t>(cell.samples() - 1);
    addSample(cell, Vector3d(x_um, 3, 0), spine);
  }
  return cell;
}

}  // namespace filiform::tools
