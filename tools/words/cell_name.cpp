#include "tools/words/cell_name.h"

#include "index/errors.h"
#include "index/set/tile_store.h"
#include "index/text.h"
#include "solver/travel/places/cell_search.h"
#include "tools/words/near_names.h"
#include "tools/words/numbers.h"

namespace filiform::tools {

namespace {

constexpr std::size_t kMostCandidates = 5;

std::string listed(const TileStore& store, const CellMatches& found, bool by_source) {
  std::string text;
  for (const std::uint32_t cell : found.cells) {
    text += text.empty() ? "" : ", ";
    ((text += '\'') += escaped(store.cell(cell).name, 80)) += '\'';
    if (by_source) ((text += " of ") += escaped(store.cell(cell).source, 80));
  }
  if (found.count > found.cells.size()) text += ", ...";
  return text;
}

// Returns whether the first match, and only the first, differs from the text in letter case alone.
bool isWholeName(const TileStore& store, const CellMatches& found, const std::string& text) {
  const auto whole = [&](std::size_t i) {
    return i < found.cells.size() && store.cell(found.cells[i]).name.size() == text.size();
  };
  return whole(0) && !whole(1);
}

}  // namespace

std::uint32_t findCellNamed(const TileStore& store, const std::string& name, const std::string& option) {
  if (const auto id = store.findCell(name)) return *id;
  const std::string given = option + " " + escaped(name, 80);
  if (!name.empty()) {
    for (const bool by_source : {false, true}) {
      const CellMatches found = matchCells(store, name, by_source, kMostCandidates);
      if (found.count == 1 || (!by_source && isWholeName(store, found, name))) return found.cells.front();
      if (found.count > 1)
        throw UsageError(given + ": the " + (by_source ? "sources" : "names") + " of " + formatCount(found.count) +
                         " cells contain this text: " + listed(store, found, by_source) + "; give more of it");
    }
  }
  NearNames near(name);
  for (std::uint32_t cell = 0; cell < store.cell_count(); ++cell)
    if (!store.cell(cell).removed) near.offer(store.cell(cell).name);
  throw UsageError(given + ": no cell has this text in its name or source" + didYouMean(near.names()) +
                   (near.names().empty() ? "; 'filiform cells SET' lists the names" : ""));
}

}  // namespace filiform::tools
