#include <filiform/index/ingest/memory_tiles.h>
#include <filiform/solver/travel/run/run.h>

#include <iostream>
#include <utility>
#include <vector>

int main() {
  filiform::Cell cell;
  cell.source = "made up";
  for (int i = 0; i < 20; ++i) {
    cell.sample_ids.push_back(i + 1);
    cell.positions_um.emplace_back(10.0 * i, 0, 0);
    cell.parents.push_back(i == 0 ? filiform::kNoParent : i - 1);
    cell.radii_um.push_back(1);
    cell.types.push_back(3);
  }
  std::vector<filiform::Cell> cells;
  cells.push_back(std::move(cell));
  filiform::CellList list(std::move(cells));
  const auto store = filiform::buildTilesInMemory(list);
  filiform::RunOptions options;
  options.in_memory = true;
  const filiform::RunSummary summary = filiform::run(*store, options);
  std::cout << toString(summary.outcome) << ", " << summary.reached_um << " um\n";
}
