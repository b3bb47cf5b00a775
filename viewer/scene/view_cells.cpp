#include "viewer/scene/view_cells.h"

#include "index/count_text.h"
#include "index/text.h"

#include <algorithm>

namespace filiform {

ViewCells viewCellsOf(const ViewState& view, const TileStore& store) {
  std::uint64_t unknown = 0;
  std::string first;
  const auto idsOf = [&](const std::vector<std::string>& names) {
    std::vector<std::uint32_t> ids;
    for (const std::string& name : names)
      if (const auto cell = store.findCell(name))
        ids.push_back(*cell);
      else if (unknown++ == 0)
        first = name;
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    return ids;
  };
  ViewCells cells;
  const auto setStates = [&cells](const std::vector<std::uint32_t>& ids, CellState state) {
    for (const std::uint32_t cell : ids) cells.states[cell] = state;
  };
  const std::vector<std::uint32_t> shown = idsOf(view.shown);
  cells.states.assign(store.cell_count(), shown.empty() ? CellState::shown : CellState::hidden);
  setStates(shown, CellState::shown);
  setStates(idsOf(view.hidden), CellState::hidden);
  setStates(idsOf(view.dimmed), CellState::dimmed);
  cells.chosen = idsOf(view.chosen);
  cells.highlighted = idsOf(view.highlighted);
  if (unknown > 0)
    cells.note = "the set does not have " + counted(unknown, "cell") + " of the view, such as " + inShort(first);
  return cells;
}

}  // namespace filiform
