// filiform path: measures and prints the path between two places of a cell.
#include "index/errors.h"
#include "index/output.h"
#include "index/query/cell_graph.h"
#include "index/query/cell_paths.h"
#include "index/query/cell_sections.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "solver/travel/places/cell_place_text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/program/interruption.h"
#include "tools/program/output_check.h"
#include "tools/words/answer.h"
#include "tools/words/cell_name.h"
#include "tools/words/found_path.h"
#include "tools/words/numbers.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <limits>
#include <optional>
#include <utility>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

struct PathArguments {
  std::shared_ptr<const RemoteArguments> remote;
  std::string set, from, to, out;
  bool to_farthest_tip = false, json = false, tsv = false;
};

std::string placeText(const CellPaths& cell, const CellPlace& place) {
  const auto [id, t] = placeName(cell, place);
  return "sample " + std::to_string(id) + (t > 0 ? "+" + formatNumber(t) : "");
}

// The section of a point of the path: the ends may lie between two samples.
SectionPlace sectionAt(const CellPaths& cell, const CellSections& sections, const FoundPath& found, std::size_t point) {
  const std::optional<std::uint32_t> sample = found.path.points[point].sample;
  return sections.of(sample ? cell.at(*sample) : point == 0 ? found.from : found.to);
}

// The points one by one, because a path may have millions.
void writePathJson(const CellPaths& cell, const CellSections* sections, const FoundPath& found) {
  std::string text = jsonText(pathHeadJson(cell, found, sections));
  text.pop_back();  // the closing brace
  std::cout << text << ",\"points\":[";
  const char* separator = "\n";
  for (std::size_t i = 0; i < found.path.points.size(); ++i) {
    nlohmann::ordered_json row = pathPointJson(cell, found.path.points[i]);
    if (sections != nullptr) {
      const auto [section, pos] = sectionAt(cell, *sections, found, i);
      row["section_id"] = section;
      row["section_pos"] = pos;
    }
    std::cout << std::exchange(separator, ",\n") << jsonText(row);
  }
  std::cout << "\n]}\n";
}

void writePathTsv(const CellPaths& cell, const CellSections* sections, const FoundPath& found) {
  std::cout << "sample\tx\ty\tz\talong\tsection_id\tsection_pos\n";
  for (std::size_t i = 0; i < found.path.points.size(); ++i) {
    const CellPath::Point& point = found.path.points[i];
    std::cout << (point.sample ? std::to_string(cell.graph().sample_ids[*point.sample]) : "-");
    for (const double value : {point.p_W.x(), point.p_W.y(), point.p_W.z(), point.along_um})
      std::cout << '\t' << formatNumber(value);
    if (sections != nullptr) {
      const auto [section, pos] = sectionAt(cell, *sections, found, i);
      std::cout << '\t' << section << '\t' << formatNumber(pos) << '\n';
    } else {
      std::cout << "\t-\t-\n";
    }
  }
}

void writePathText(std::ostream& out, const CellPaths& cell, const CellSections* sections, const FoundPath& found,
                   bool to_tip) {
  const auto hundredths = [](double value) {
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), "%.2f", value);
    return std::string(text.data());
  };
  out << escaped(cell.graph().name) << ": from " << placeText(cell, found.from) << " to "
      << (to_tip ? "the farthest tip, " : "") << placeText(cell, found.to) << ": " << hundredths(found.path.length_um())
      << " um along the cell, " << hundredths(found.straight_um()) << " um straight, "
      << counted(found.path.points.size(), "point") << "\n";
  if (sections == nullptr) return;
  const SectionPlace from = sections->of(found.from), to = sections->of(found.to);
  out << "  from section " << from.section << " at " << formatNumber(from.pos) << " to section " << to.section << " at "
      << formatNumber(to.pos) << ", numbered as in SONATA\n";
}

// An unbranched cell of the path's points, with ids from 1. A point between two samples is rounded to the grid, and has
// the radius and type of its segment.
CellGraph cellOfPath(const CellPaths& cell, const FoundPath& found) {
  const CellGraph& graph = cell.graph();
  CellGraph line;
  line.name = graph.name + " from " + placeText(cell, found.from) + " to " + placeText(cell, found.to);
  line.source = graph.source;
  line.grid = graph.grid;
  for (std::size_t i = 0; i < found.path.points.size(); ++i) {
    const CellPath::Point& point = found.path.points[i];
    const std::uint32_t rank = point.sample.value_or(i == 0 ? found.from.child : found.to.child);
    line.positions.push_back(graph.grid.snap(point.p_W));
    line.parents.push_back(i == 0 ? kNoParent : static_cast<std::uint32_t>(i) - 1);
    line.sample_ids.push_back(static_cast<std::int64_t>(i) + 1);
    line.radii_um.push_back(graph.radii_um[rank]);
    line.types.push_back(graph.types[rank]);
  }
  return line;
}

void checkArguments(const PathArguments& a) {
  if (a.to.empty() != a.to_farthest_tip)
    throw UsageError("path: give one of: a second place TO, such as CELL:ID, or --to-farthest-tip");
  if (a.out.empty()) return;
  const std::string ending = std::filesystem::path(a.out).extension().string();
  if (a.out != "-" && !ending.empty() && !endsWithNoCase(a.out, ".swc") && isFileOutput(a.out))
    throw UsageError("--output " + inShort(a.out) + ": path writes SWC; give a name with the ending .swc");
  checkOutputs({{"SET", a.set}}, {{"--output", a.out}, {"--json", a.json ? "-" : ""}, {"--tsv", a.tsv ? "-" : ""}});
}

int runPath(const PathArguments& a) {
  checkArguments(a);
  const CellPlaceText from = parseCellPlace("FROM", a.from);
  std::optional<CellPlaceText> to;
  if (!a.to_farthest_tip) to = parseCellPlace("TO", a.to);
  const auto set = TileSet::open(a.set, a.remote->options());
  const std::uint32_t cell_id = findCellNamed(*set, from.cell, "FROM");
  if (to) {
    const std::uint32_t other = findCellNamed(*set, to->cell, "TO");
    if (other != cell_id)
      throw UsageError("FROM is in '" + escaped(set->cell(cell_id).name, 80) + "' and TO in '" +
                       escaped(set->cell(other).name, 80) + "'; a path joins two places of one cell");
  }
  const CellPaths cell(readCell(*set, cell_id, true));
  throwIfInterrupted();
  const FoundPath found = to ? pathBetween(cell, from, *to, throwIfInterrupted) : pathToFarthestTip(cell, from);
  if (!found.note.empty()) std::cerr << "filiform: note: " << found.note << '\n';
  if (!a.out.empty()) {
    Output out(a.out, {.cancel = &interruptFlag()});
    writeSwc(out.stream(), cellOfPath(cell, found));
    out.finish();
  }
  std::optional<CellSections> with_sections;
  if (!cell.graph().isGraph()) with_sections.emplace(cell);
  const CellSections* const sections = with_sections ? &*with_sections : nullptr;
  if (a.json)
    writePathJson(cell, sections, found);
  else if (a.tsv)
    writePathTsv(cell, sections, found);
  else
    writePathText(!a.out.empty() && isStandardOutput(a.out) ? std::cerr : std::cout, cell, sections, found,
                  a.to_farthest_tip);
  return 0;
}

}  // namespace

void addPath(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<PathArguments>();
  CLI::App* command = app.add_subcommand("path", "Measure the path along a cell between two places");
  command->footer(
      "Examples:\n  filiform path column.fil CELL:1 CELL:245\n  filiform path column.fil CELL:soma --to-farthest-tip\n"
      "  filiform path column.fil CELL:12+0.25 CELL:245 --tsv\n"
      "  filiform path column.fil CELL:1 CELL:245 -o path.swc\n"
      "  filiform path column.fil CELL:section3+0.5 CELL:soma\n"
      "A place is CELL:soma; CELL:ID, with the id of a sample in its file; CELL:ID+T, between the sample (T = 0) and\n"
      "its parent (T = 1); CELL:X,Y,Z, the sample of the cell that is nearest to a point, um; or CELL:sectionN+POS, "
      "in\n"
      "section N as SONATA and NEURON number them, from its beginning (POS = 0) to its end (POS = 1).\n"
      "In a cell with loops, the shortest path is taken.");
  command->add_option("SET", a->set, "tile set, or its address")->required();
  command->add_option("FROM", a->from, "place where the path begins")->required()->type_name("PLACE");
  command->add_option("TO", a->to, "place where the path ends, on the same cell")->type_name("PLACE");
  command->add_flag("--to-farthest-tip", a->to_farthest_tip, "end the path at the tip that is farthest along the cell");
  command->add_option("-o,--output", a->out, "write the path as SWC, with ids from 1; - for standard output")
      ->type_name("FILE");
  command->add_flag("--json", a->json, "write one JSON object, with the points of the path");
  command->add_flag("--tsv", a->tsv, "write the points of the path as tab-separated rows")->excludes("--json");
  a->remote = addRemoteArguments(*command);
  command->callback([a, &chosen] { chosen = [a] { return runPath(*a); }; });
}

}  // namespace filiform::tools
