// Making a tile set from Python.
#include "index/ingest/ingest.h"

#include "index/circuits/placements.h"
#include "index/count_text.h"
#include "index/errors.h"
#include "index/ingest/growth.h"
#include "index/ingest/input_provenance.h"
#include "index/input/input.h"
#include "index/text.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/calls.h"
#include "tools/words/unit.h"

#include <algorithm>
#include <atomic>
#include <optional>
#include <pybind11/stl.h>
#include <thread>

namespace filiform::python {

namespace {

struct Wanted {
  std::vector<std::string> inputs;
  std::string output, unit, placements;  // placements: the text of a table
  std::uint64_t memory, capacity;
  int quantum_exponent;
  unsigned threads;
  bool apply_offset, strict, levels, force, add;
};

struct Made {
  GrowthResult result;
  std::string summary, doubt;
  std::vector<std::pair<std::string, std::string>> refused;
  InputTotals totals;
};

void requireUsable(const std::vector<SourceReport>& reports, bool strict) {
  const InputTotals all = totals(reports);
  if (strict && all.refused > 0)
    throw InputError("strict: " + counted(all.refused, "input") + " refused; nothing was written");
  if (all.accepted + all.warned > 0) return;
  const std::string first =
      reports.empty() ? "nothing was read" : inShort(reports.front().file) + ": " + refusedFor(reports.front().report);
  throw InputError("inputs: no usable neuron (" + first + ")");
}

void collectRefused(const std::vector<SourceReport>& reports, Made& made) {
  for (const SourceReport& row : reports) {
    if (!row.archive && row.report.severity == Severity::kRefuse)
      made.refused.emplace_back(row.file, refusedFor(row.report));
    for (const EntryReport& entry : row.entries)
      if (entry.dropped) made.refused.emplace_back(row.file + "/" + entry.entry, refusedFor(entry.report));
  }
}

Made make(const Wanted& wanted, const std::atomic<bool>& cancel, const std::function<void(WorkProgress)>& tell) {
  InputOptions reading;
  reading.swc = {.apply_offset = wanted.apply_offset, .strict = wanted.strict};
  tools::readUnit(wanted.unit, reading.swc);
  reading.memory = wanted.memory;
  reading.threads = wanted.threads != 0 ? wanted.threads : std::max(1u, std::thread::hardware_concurrency());
  if (!wanted.placements.empty()) reading.cell_share = kPlacedCellShare;
  reading.progress = [&](std::uint64_t done, std::uint64_t total) {
    if (cancel) throw Interrupted("interrupted");
    tell({"read", done, total});
  };
  IngestOptions options;
  options.capacity = static_cast<std::uint32_t>(wanted.capacity);
  options.quantum_exponent = wanted.quantum_exponent;
  options.threads = wanted.threads;
  options.memory = wanted.memory;
  options.levels = wanted.levels;
  options.force = wanted.force;
  options.cancel = &cancel;
  options.progress = [&](const char* phase, std::uint64_t done, std::uint64_t total) { tell({phase, done, total}); };

  Input input(wanted.inputs, reading);
  options.stream_bytes = input.held_bytes();
  options.reading_bytes = input.reading_bytes();
  std::optional<PlacedCells> placed;
  if (!wanted.placements.empty()) {
    placed.emplace(input, PlacementTable::parse(wanted.placements, "placements"));
    options.stream_bytes += placed->held_bytes();
  }
  options.provenance = [&] {
    requireUsable(input.reports(), wanted.strict);
    if (placed && placed->report().placed == 0) throw InputError("placements: no row places a morphology");
    return provenanceOf(input.reports(), placed ? &*placed : nullptr);
  };
  CellStream& cells = placed ? static_cast<CellStream&>(*placed) : input;
  Made made;
  if (wanted.add)
    made.result = addCells(cells, wanted.output, options);
  else
    made.result.set = ingest(cells, wanted.output, options);
  made.summary = summary(input.reports());
  made.doubt = input.unitDoubt();
  made.totals = totals(input.reports());
  collectRefused(input.reports(), made);
  return made;
}

py::dict ingestInputs(const std::vector<std::string>& inputs, const std::string& output, const std::string& unit,
                      const std::string& placements, std::uint64_t memory, py::handle threads, std::uint64_t capacity,
                      int quantum_exponent, bool apply_offset, bool strict, bool levels, bool force, bool add,
                      py::object progress) {
  if (memory < kMinIngestMemory) throw py::value_error("memory: give at least 64MiB");
  if (capacity < 1 || capacity > (1u << 30)) throw py::value_error("capacity: give 1 to 2^30 segments");
  const Wanted wanted{inputs,
                      output,
                      unit,
                      placements,
                      memory,
                      capacity,
                      quantum_exponent,
                      static_cast<unsigned>(std::min<std::uint64_t>(countArgument("threads", threads, 0), 256)),
                      apply_offset,
                      strict,
                      levels,
                      force,
                      add};
  std::atomic<bool> cancel{false};
  Made made;
  runLong(
      cancel, [&](const std::function<void(WorkProgress)>& tell) { made = make(wanted, cancel, tell); },
      [&](const WorkProgress& told) {
        if (!progress.is_none()) progress(told.phase, told.done, told.total);
      });
  using namespace pybind11::literals;
  py::list refused;
  for (const auto& [name, reason] : made.refused) refused.append(py::make_tuple(py::bytes(name), py::bytes(reason)));
  const SetCounts& counts = made.result.set.counts;
  return py::dict("revision"_a = made.result.set.revision, "cells"_a = counts.cells, "samples"_a = counts.samples,
                  "segments"_a = counts.segments, "tiles"_a = counts.tiles, "bytes"_a = made.result.set.bytes,
                  "unchanged"_a = made.result.set.unchanged, "accepted"_a = made.totals.accepted + made.totals.warned,
                  "refused"_a = refused, "summary"_a = py::bytes(made.summary), "note"_a = py::bytes(made.doubt));
}

}  // namespace

void addIngest(py::module_& module) { module.def("ingest", &ingestInputs); }

}  // namespace filiform::python
