#include "tools/words/making/making.h"

#include "index/circuits/attribute_table.h"
#include "index/circuits/placements.h"
#include "index/count_text.h"
#include "index/errors.h"
#include "index/ingest/input_provenance.h"
#include "index/ranks/rank_inputs.h"
#include "index/text.h"
#include "tools/words/making/circuit_text.h"

#include <algorithm>
#include <filesystem>
#include <thread>
#include <utility>

namespace filiform::tools {

namespace {

std::string placementText(const PlacedCells& placed) {
  const PlacementReport& report = placed.report();
  std::string text = inShort(placed.table().file()) + ": places " +
                     counted(report.morphologies, "morphology", "morphologies") + " " + counted(report.placed, "time") +
                     ": " + counted(report.samples, "sample") + ", " + counted(report.segments, "segment") + "\n";
  for (const auto& [code, count] : report.codes.all())
    text += "  " + std::string(name(code)) + " " + formatCount(count) + ": " +
            (code == InputCode::W_BAD_LINE ? "the morphology of the row was refused; row dropped"
                                           : std::string(explanation(code))) +
            "\n";
  return text;
}

std::string attributesText(const AttributedCells& attributed) {
  const AttributeTable& table = attributed.table();
  std::string text = inShort(table.file()) + ": attributes: " + formatCount(table.names().size()) +
                     "; cells with a row: " + formatCount(attributed.with_row()) +
                     ", without: " + formatCount(attributed.without_row()) +
                     "; rows without a cell: " + formatCount(attributed.rows_without_cell());
  if (table.repeated() > 0) text += "; rows left out, because their key came before: " + formatCount(table.repeated());
  return text + "\n";
}

// A doubt about the table: perhaps --key names the wrong column.
std::string doubtAbout(const AttributedCells& attributed) {
  if (attributed.with_row() > 0 || attributed.table().rows() == 0 || attributed.without_row() == 0) return {};
  return inShort(attributed.table().file()) + ": no row belongs to a cell: the first row is for '" +
         escaped(attributed.table().first_key(), 60) + "', and the first cell is '" +
         escaped(attributed.first_cell(), 60) + "'; does --key name the right column?";
}

}  // namespace

unsigned threadsOr(unsigned given) { return given != 0 ? given : std::max(1u, std::thread::hardware_concurrency()); }

MorphologyVersion morphologyVersion(const std::string& word, const std::string& option) {
  if (word == "cng") return MorphologyVersion::cng;
  if (word == "source") return MorphologyVersion::source;
  if (word == "both") return MorphologyVersion::both;
  throw UsageError(option + ": choose cng, source or both, not '" + inShort(word) + "'");
}

void checkOrder(const MakingOrder& order, bool force) {
  if (!order.remove.empty() && (order.add || !order.inputs.empty()))
    throw UsageError("--remove: takes no INPUT; remove first, then add with --add");
  if (order.attributes.path.empty() != order.key.empty())
    throw UsageError("--attributes and --key go together: the table, and its column with the names of cells");
  if ((order.add || order.sync || !order.remove.empty()) && force)
    throw UsageError("--force replaces a set; leave it out with --add, --sync and --remove");
  if (order.sync && (order.add || !order.remove.empty()))
    throw UsageError("--sync adds and removes by itself; leave out --add and --remove");
  if (order.remove_gone && !order.sync) throw UsageError("--delete belongs to --sync; --remove CELL removes one cell");
  if (order.sync && !order.placements.path.empty())
    throw UsageError("--sync follows files and folders; leave out --placements, or make the set again with --force");
  if (order.remove.empty() && order.inputs.empty())
    throw UsageError("INPUT is missing: give files, folders or archives");
}

MakingResult make(MakingOrder order, IngestOptions options) {
  MakingResult made;
  if (!order.remove.empty()) {
    static_cast<GrowthResult&>(made) = removeCells(order.remove, order.output, options);
    return made;
  }
  Ranks* const ranks = options.ranks;
  const bool is_first = ranks == nullptr || ranks->rank() == 0;
  order.reading.memory = options.memory;
  order.reading.threads = threadsOr(options.threads);
  refuseSeveralCircuits(order.inputs);
  const bool has_table = !order.placements.path.empty();
  std::optional<Circuit> circuit;
  if (!has_table && Circuit::isCircuit(order.inputs, order.circuit))
    circuit.emplace(Circuit::read(order.inputs.front(), order.circuit));
  else if (!order.circuit.population.empty() || !order.circuit.morphologies.empty())
    throw UsageError("--population and --morphologies are for one circuit_config.json or one nodes.h5");
  if (circuit && order.sync)
    throw UsageError("--sync follows files and folders; make the set of a circuit again with --force");
  if (circuit || has_table) order.reading.cell_share = kPlacedCellShare;
  Input input = circuit ? Input(circuit->files(), order.reading) : Input(order.inputs, order.reading);
  options.stream_bytes = input.held_bytes();
  options.reading_bytes = input.reading_bytes();
  std::optional<PlacedCells> table;
  std::optional<CircuitCells> circuit_cells;
  if (circuit) circuit_cells.emplace(input, *circuit);
  if (has_table)
    table.emplace(input, order.placements.text ? PlacementTable::parse(*order.placements.text, order.placements.path)
                                               : PlacementTable::read(order.placements.path));
  const PlacedCells* const placed = circuit ? &circuit_cells->placed() : table ? &*table : nullptr;
  if (placed != nullptr) options.stream_bytes += placed->held_bytes();
  std::optional<RankInputs> parts;
  if (ranks != nullptr)
    parts.emplace(*ranks, input, table ? &*table : nullptr, circuit_cells ? &*circuit_cells : nullptr);
  std::optional<AttributeTable> attributes;
  if (!order.attributes.path.empty()) {
    attributes.emplace(order.attributes.text
                           ? AttributeTable::parse(*order.attributes.text, order.attributes.path, order.key)
                           : AttributeTable::read(order.attributes.path, order.key));
    options.stream_bytes += attributes->held_bytes();
  }
  CellStream& cells = circuit ? static_cast<CellStream&>(*circuit_cells)
                      : table ? *table
                              : static_cast<CellStream&>(input);
  std::optional<AttributedCells> attributed;
  if (attributes) attributed.emplace(cells, *attributes);
  CellStream& all_cells = attributed ? static_cast<CellStream&>(*attributed) : cells;
  std::error_code error;
  const bool follows = order.sync && std::filesystem::exists(order.output + "/CURRENT", error);
  const auto tell = [&](const std::map<std::string, SyncFate>* fates) {
    if (order.report) order.report(made.reports, fates);
  };
  options.provenance = [&] {
    if (order.ended_reading) order.ended_reading();
    if (parts) parts->gather(attributed ? &*attributed : nullptr);
    if (!is_first) return Provenance{};
    made.reports = reportsOf(input, circuit ? &*circuit : nullptr);
    if (!follows) tell(nullptr);  // also if the inputs are then refused
    try {
      requireUsable(made.reports, circuit && !circuit->graphs().empty() ? nullptr : placed, order.reading.swc.strict);
    } catch (const InputError&) {
      if (follows) tell(nullptr);
      throw;
    }
    return provenanceOf(made.reports, placed);
  };
  if (follows)
    static_cast<SyncResult&>(made) =
        syncCells(all_cells, order.output, {order.remove_gone, [&](const auto& fates) { tell(&fates); }}, options);
  else if (order.add)
    static_cast<GrowthResult&>(made) = addCells(all_cells, order.output, options);
  else
    made.set = ingest(all_cells, order.output, options);
  if (!follows) made.counts.added = made.set.counts.cells;
  if (!is_first) return made;
  made.text = summary(made.reports);
  if (circuit) made.text += describePopulations(circuit->populationsOf(made.reports));
  if (placed != nullptr) made.text += placementText(*placed);
  if (attributed) made.text += attributesText(*attributed);
  if (circuit) made.notes = circuit->doubts();
  if (attributed) made.notes.push_back(doubtAbout(*attributed));
  made.notes.push_back(input.unitDoubt());
  std::erase(made.notes, "");
  return made;
}

}  // namespace filiform::tools
