#include "tools/commands/figure/only_cells.h"

#include "index/attributes/cell_attributes.h"
#include "index/count_text.h"
#include "index/errors.h"
#include "index/ingest/memory_tiles.h"
#include "index/subsets/set_cells.h"
#include "index/text.h"
#include "tools/commands/shared/cell_conditions.h"
#include "tools/program/interruption.h"
#include "tools/words/cell_name.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iostream>
#include <thread>

namespace filiform::tools {
namespace {

void addFromFile(const TileSet& set, const std::string& path, std::vector<std::uint32_t>& cells) {
  const std::size_t before = cells.size();
  std::uint64_t names = 0, unknown = 0;
  std::string first;
  std::ifstream in(path);
  if (!in) throw IoError(inShort(path), "cannot open", errno);
  for (std::string name; std::getline(in, name);) {
    throwIfInterrupted();
    if (name.ends_with('\r')) name.pop_back();
    if (name.empty()) continue;
    ++names;
    if (const auto cell = set.findCell(name))
      cells.push_back(*cell);
    else if (unknown++ == 0)
      first = name;
  }
  if (in.bad()) throw IoError(inShort(path), "cannot read");
  if (cells.size() == before)
    throw UsageError("--only @" + inShort(path) + ": " +
                     (names == 0
                          ? "no name in the file; give the name of a cell a line"
                          : "the set has none of its " + counted(names, "name") + ", such as " + inShort(first)));
  if (unknown > 0)
    std::cerr << "filiform: note: --only @" << inShort(path) << ": the set does not have " << formatCount(unknown)
              << " of " << counted(names, "name") << ", such as " << inShort(first) << '\n';
}

}  // namespace

std::vector<std::uint32_t> onlyCells(const TileSet& set, const std::vector<std::string>& words) {
  std::vector<std::uint32_t> cells;
  for (const std::string& word : words) {
    if (word.starts_with('@')) {
      addFromFile(set, word.substr(1), cells);
    } else if (word.find_first_of("=<>") != std::string::npos && !set.findCell(word)) {
      const auto met = cellsMeeting(CellConditions({word}), set, CellAttributes(set), 0);
      if (met.empty()) throw UsageError("--only " + inShort(word) + ": no cell meets this condition");
      cells.insert(cells.end(), met.begin(), met.end());
    } else {
      cells.push_back(findCellNamed(set, word, "--only"));
    }
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

SomeCells sceneOfCells(const TileSet& set, const std::vector<std::uint32_t>& cells) {
  std::uint64_t segments = 0;
  for (const std::uint32_t cell : cells) segments += set.cell(cell).segments;
  if (segments > kMostOnlySegments)
    throw UsageError("--only: " + counted(cells.size(), "cell") + " with " + counted(segments, "segment") +
                     "; a scene of some cells has " + formatCount(kMostOnlySegments) +
                     " at most: make a set of them with filiform ingest, or name fewer");
  SetCells stream(set, cells,
                  {.threads = std::max(1U, std::thread::hardware_concurrency()), .check = throwIfInterrupted});
  return {buildTilesInMemory(stream), stream.cells()};
}

std::shared_ptr<const CellColours> coloursOfCells(const CellColours* colours, const std::vector<std::uint32_t>& cells) {
  auto some = std::make_shared<CellColours>(colours != nullptr ? *colours : CellColours());
  some->of_cell.clear();
  some->is_chosen.clear();
  for (const std::uint32_t cell : cells)
    some->of_cell.push_back(colours != nullptr ? colours->of_cell.at(cell) : colourOfNumber(cell));
  return some;
}

}  // namespace filiform::tools
