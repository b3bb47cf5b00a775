#include <filiform/index/ingest/memory_tiles.h>
#include <filiform/index/input/input.h>
#include <filiform/index/query/nearest.h>

#include <iostream>
#include <vector>

int main(int count, char** arguments) {
  filiform::Cell cell;
  if (count > 1) {
    filiform::Input input({arguments[1]});
    while (input.next(cell)) std::cout << cell.source << " has " << cell.samples() << " samples\n";
    return 0;
  }
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
