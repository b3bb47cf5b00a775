// Making a tile set from Python.
#include "index/ingest/ingest.h"

#include "index/circuits/circuit.h"
#include "index/circuits/placements.h"
#include "index/count_text.h"
#include "index/errors.h"
#include "index/ingest/growth.h"
#include "index/ingest/input_provenance.h"
#include "index/input/input.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/calls.h"
#include "tools/words/unit.h"

#include <algorithm>
#include <atomic>
#include <iterator>
#include <memory>
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
  bool apply_offset, one_cell_a_file, strict, levels, force, add;
};

struct Made {
  GrowthResult result;
  std::string doubt;
  std::vector<SourceReport> reports;
};

// The records of all inputs, one after the other. Made in Python by `records()` of the result; read once.
class RecordReader {
 public:
  explicit RecordReader(std::shared_ptr<const std::vector<SourceReport>> reports) : reports_(std::move(reports)) {
    for (const SourceReport& row : *reports_) {
      // The records of an archive are those of the archive itself; its entries have their own.
      parts_.push_back({row.file, &row.report.records});
      for (const EntryReport& entry : row.entries)
        parts_.push_back({row.file + "/" + entry.entry, &entry.report.records});
    }
  }
  // (input, line, code, effect, token)
  py::tuple next() {
    while (!at_ || *at_ == std::default_sentinel) {
      if (part_ == parts_.size()) throw py::stop_iteration();
      at_.emplace(*parts_[part_++].records);
    }
    const InputRecord& record = **at_;
    py::tuple row = py::make_tuple(py::bytes(parts_[part_ - 1].input), record.line, std::string(name(record.code)),
                                   std::string(name(record.effect)), py::bytes(record.token));
    ++*at_;
    return row;
  }

 private:
  struct Part {
    std::string input;
    const InputRecords* records;
  };
  std::shared_ptr<const std::vector<SourceReport>> reports_;
  std::vector<Part> parts_;
  std::size_t part_ = 0;
  std::optional<InputRecords::Iterator> at_;
};

std::uint64_t recordCount(const std::vector<SourceReport>& reports) {
  std::uint64_t count = 0;
  for (const SourceReport& row : reports) {
    count += row.report.records.size();
    for (const EntryReport& entry : row.entries) count += entry.report.records.size();
  }
  return count;
}

Made make(const Wanted& wanted, const std::atomic<bool>& cancel, const std::function<void(WorkProgress)>& tell) {
  InputOptions reading;
  reading.swc = {.apply_offset = wanted.apply_offset, .strict = wanted.strict};
  tools::readUnit(wanted.unit, reading.swc);
  reading.one_cell_a_file = wanted.one_cell_a_file;
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
    requireUsable(input.reports(), placed ? &*placed : nullptr, wanted.strict);
    return provenanceOf(input.reports(), placed ? &*placed : nullptr);
  };
  CellStream& cells = placed ? static_cast<CellStream&>(*placed) : input;
  Made made;
  if (wanted.add)
    made.result = addCells(cells, wanted.output, options);
  else
    made.result.set = ingest(cells, wanted.output, options);
  made.doubt = input.unitDoubt();
  made.reports = input.reports();
  return made;
}

py::dict ingestInputs(const std::vector<std::string>& inputs, const std::string& output, const std::string& unit,
                      const std::string& placements, std::uint64_t memory, py::handle threads, std::uint64_t capacity,
                      int quantum_exponent, bool apply_offset, bool one_cell_a_file, bool strict, bool levels,
                      bool force, bool add, py::object progress) {
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
                      one_cell_a_file,
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
  const auto reports = std::make_shared<const std::vector<SourceReport>>(std::move(made.reports));
  py::list refused, skipped;
  forEachInput(*reports, [&](const std::string& input, const InputReport&, const InputOutcome& outcome) {
    if (outcome.isLost())
      (outcome.fate == InputFate::kRefused ? refused : skipped)
          .append(py::make_tuple(py::bytes(input), py::bytes(outcome.reason)));
  });
  const SetCounts& counts = made.result.set.counts;
  const InputTotals all = totals(*reports);
  const auto read = [reports] { return RecordReader(reports); };
  return py::dict("revision"_a = made.result.set.revision, "cells"_a = counts.cells, "samples"_a = counts.samples,
                  "segments"_a = counts.segments, "tiles"_a = counts.tiles, "bytes"_a = made.result.set.bytes,
                  "unchanged"_a = made.result.set.unchanged, "accepted"_a = all.accepted + all.warned,
                  "refused"_a = refused, "skipped"_a = skipped, "passed_over"_a = all.passed_over,
                  "records"_a = py::make_tuple(recordCount(*reports), py::cpp_function(read)),
                  "summary"_a = py::bytes(summary(*reports)), "note"_a = py::bytes(made.doubt));
}

}  // namespace

void addIngest(py::module_& module) {
  py::class_<RecordReader>(module, "RecordReader")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &RecordReader::next);
  module.def("ingest", &ingestInputs);
  module.def("is_circuit", [](const std::string& path) { return Circuit::isCircuit({path}, {}); });
}

}  // namespace filiform::python
