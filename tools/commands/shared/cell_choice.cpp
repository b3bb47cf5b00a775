#include "tools/commands/shared/cell_choice.h"

#include "index/attributes/cell_attributes.h"
#include "index/subsets/subset.h"
#include "index/text.h"
#include "tools/commands/shared/cell_conditions.h"
#include "tools/program/interruption.h"
#include "tools/words/cell_name.h"
#include "tools/words/filter_words.h"
#include "tools/words/near_names.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <iostream>
#include <thread>

#include <CLI/CLI.hpp>

namespace filiform::tools {
namespace {

std::string boxText(const Grid& grid, const GridBox& box) {
  std::string text;
  for (const GridPoint& corner : {box.lo, box.hi})
    for (const double x : grid.toWorld(corner)) text += (text.empty() ? "" : " ") + formatNumber(x);
  return text;
}

// The values of an attribute of text that are near the one of a condition which no cell meets.
std::string nearValues(const CellAttributes& attributes, const std::string& condition) {
  const AttributeConditions::Condition parsed = AttributeConditions({condition}).all().front();
  const auto column = attributes.find(parsed.name);
  if (!column || attributes.columns()[*column].type != AttributeType::text) return {};
  NearNames near(parsed.value);
  for (const std::string& value : attributes.dictionary(*column)) near.offer(value);
  return didYouMean(near.names());
}

}  // namespace

std::vector<std::uint16_t> CellChoice::sampleTypes() const {
  std::string all;
  for (const std::string& some : types) all += (all.empty() ? "" : ",") + some;
  return types.empty() ? std::vector<std::uint16_t>{} : parseSegmentTypes(all, ',', "--type");
}

std::vector<std::uint32_t> CellChoice::select(const TileSet& set, unsigned threads) const {
  const unsigned workers = threads > 0 ? threads : std::max(1U, std::thread::hardware_concurrency());
  const CellAttributes attributes(set);
  const CellConditions conditions(where);
  const std::vector<std::uint16_t> sample_types = sampleTypes();
  std::vector<double> corners;
  for (const std::string& word : box) corners.push_back(parseNumber("--box", word));
  for (const double x : corners)
    if (!(std::abs(x) <= Grid::kMaxCoordinate_um))
      throw UsageError("--box " + formatNumber(x) + ": a corner must lie within 2^30 um of the origin");

  std::vector<std::uint32_t> chosen;
  for (const std::string& name : cells) chosen.push_back(findCellNamed(set, name, "--cell"));
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  const bool all_named = !cells.empty() && where.empty();  // the records of other cells are then not read
  std::vector<std::uint32_t> met = all_named ? chosen : cellsMeeting(conditions, set, attributes, threads);
  if (met.empty()) {
    if (where.empty()) throw InputError("the tile set has no cell");
    for (const std::string& condition : where)
      if (cellsMeeting(CellConditions({condition}), set, attributes, threads).empty())
        throw UsageError("--where " + inShort(condition) + ": no cell meets it" + nearValues(attributes, condition));
    throw UsageError("--where: no cell meets all conditions");
  }
  if (!cells.empty())
    std::erase_if(met, [&](std::uint32_t cell) { return !std::binary_search(chosen.begin(), chosen.end(), cell); });
  if (met.empty()) throw UsageError("--where: no cell of --cell meets the conditions");

  const SubsetPass pass{.threads = workers, .check = throwIfInterrupted};
  if (!corners.empty()) {
    const Vector3d a(corners[0], corners[1], corners[2]), b(corners[3], corners[4], corners[5]);
    met = cellsInBox(set, met, {set.grid().snap(a.cwiseMin(b)), set.grid().snap(a.cwiseMax(b))}, pass);
    if (met.empty())
      throw UsageError("--box: no chosen cell has a segment in the box; the set extends over " +
                       boxText(set.grid(), set.bounds()) + " um");
  }
  if (!sample_types.empty()) {
    const std::size_t before = met.size();
    met = cellsWithTypes(set, met, sample_types, pass);
    if (met.empty())
      throw UsageError("--type " + inShort(types.front()) + ": no chosen cell has a sample of this type");
    if (met.size() < before)
      std::cerr << "filiform: note: " << counted(before - met.size(), "cell has", "cells have")
                << " no sample of these types, and no part in the output\n";
  }
  return met;
}

void addCellAndType(CLI::App& command, std::vector<std::string>& cells, std::vector<std::string>& types,
                    const std::string& does) {
  command.add_option("--cell", cells, does + " the cell of this name; repeatable")
      ->type_name("NAME")
      ->allow_extra_args(false);
  command
      .add_option(
          "--type", types,
          does +
              " only samples of these types: axon, basal, apical, dendrite, soma, undefined, or codes of SWC; a "
              "sample whose parent is left out becomes a root; repeatable")
      ->type_name("TYPE,...")
      ->allow_extra_args(false);
}

void addCellChoice(CLI::App& command, CellChoice& choice, const std::string& does) {
  addCellAndType(command, choice.cells, choice.types, does);
  command
      .add_option("--where", choice.where,
                  does +
                      " the cells whose attribute meets NAME=VALUE, NAME!=VALUE, NAME<NUMBER, <=, > or >=; VALUE may "
                      "have * ? [ab]; measure:FEATURE is a measure; repeatable: all must hold")
      ->type_name("CONDITION")
      ->allow_extra_args(false);
  command.add_option("--box", choice.box, does + " the cells that have a segment in this box, whole, um")
      ->expected(6)
      ->type_name("X0 Y0 Z0 X1 Y1 Z1");
}

}  // namespace filiform::tools
