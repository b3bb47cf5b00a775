#include <filiform/index/ingest/memory_tiles.h>
#include <filiform/index/query/nearest.h>

#include <iostream>
#include <vector>

int main() {
  filiform::Cell cell;
  cell.source = "made up";
  cell.sample_ids = {1, 2};
  cell.positions_um = {{0, 0, 0}, {10, 0, 0}};
  cell.parents = {filiform::kNoParent, 0};
  cell.radii_um = {1, 1};
  cell.types = {3, 3};
  std::vector<filiform::Cell> cells{cell};
  filiform::CellList list(cells);
  const auto store = filiform::buildTilesInMemory(list);
  std::cout << filiform::Nearest(*store).find({5, 3, 0}).at(0).distance_um << " um\n";
}
