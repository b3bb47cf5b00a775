// Making a tile set from Python.
#include "index/ingest/ingest.h"

#include "index/circuits/circuit.h"
#include "index/errors.h"
#include "index/ingest/growth.h"
#include "index/input/input.h"
#include "index/subsets/set_cells.h"
#include "index/subsets/subset.h"
#include "index/text.h"
#include "index/verify/verify.h"
#include "tools/python/internal/arguments.h"
#include "tools/python/internal/bindings.h"
#include "tools/python/internal/calls.h"
#include "tools/python/internal/set_handle.h"
#include "tools/synthetic/synthetic.h"
#include "tools/words/filter_words.h"
#include "tools/words/making/cell_export.h"
#include "tools/words/making/circuit_text.h"
#include "tools/words/making/making.h"
#include "tools/words/token.h"
#include "tools/words/unit.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <pybind11/stl.h>
#include <utility>
#include <vector>

namespace filiform::python {

namespace {

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
  // (input, line, code, effect, token, explanation)
  py::tuple next() {
    while (!at_ || *at_ == std::default_sentinel) {
      if (part_ == parts_.size()) throw py::stop_iteration();
      at_.emplace(*parts_[part_++].records);
    }
    const InputRecord& record = **at_;
    py::tuple row = py::make_tuple(py::bytes(parts_[part_ - 1].input), record.line, std::string(name(record.code)),
                                   std::string(name(record.effect)), py::bytes(record.token),
                                   std::string(explanation(record.code)));
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

// What became of the inputs, for the reports of Python.
py::dict reportsOf(std::vector<SourceReport> of_inputs) {
  using namespace pybind11::literals;
  const auto reports = std::make_shared<const std::vector<SourceReport>>(std::move(of_inputs));
  py::list refused, skipped, files;
  forEachInput(*reports, [&](const std::string& input, const InputReport& report, const InputOutcome& outcome) {
    if (outcome.isLost())
      (outcome.fate == InputFate::kRefused ? refused : skipped)
          .append(py::make_tuple(py::bytes(input), py::bytes(outcome.reason)));
    if (outcome.fate != InputFate::kPassed)
      files.append(py::make_tuple(py::bytes(input), std::string(name(outcome.fate)), py::bytes(outcome.reason),
                                  report.samples, report.segments));
  });
  const InputTotals all = totals(*reports);
  const auto read = [reports] { return RecordReader(reports); };
  return py::dict("accepted"_a = all.accepted + all.warned, "refused"_a = refused, "skipped"_a = skipped,
                  "passed_over"_a = all.passed_over, "files"_a = files,
                  "records"_a = py::make_tuple(recordCount(*reports), py::cpp_function(read)));
}

// The arguments of Python, by name: unknown ones are errors of this package.
class Arguments {
 public:
  explicit Arguments(py::dict values) : values_(std::move(values)) {}
  bool has(const char* name) const { return values_.contains(name); }
  template <typename T>
  T get(const char* name, T otherwise = {}) const {
    return has(name) ? values_[name].cast<T>() : otherwise;
  }
  py::object raw(const char* name) const { return has(name) ? py::object(values_[name]) : py::none(); }

 private:
  py::dict values_;
};

RemoteOptions remoteOf(const Arguments& a) {
  RemoteOptions remote;
  if (const auto token = a.get<std::string>("token"); !token.empty()) remote.token = tools::tokenIn(token, "token");
  remote.cache_folder = a.get<std::string>("cache");
  remote.cache_bytes = a.get<std::uint64_t>("cache_size", remote.cache_bytes);
  if (a.has("connections"))
    remote.connections = static_cast<unsigned>(countArgument("connections", a.raw("connections"), 1));
  if (remote.connections > 64) throw py::value_error("connections: give 1 to 64");
  return remote;
}

tools::MakingTable tableOf(const Arguments& a, const char* name) {
  tools::MakingTable table{.path = a.get<std::string>(name)};
  const std::string text = std::string(name) + "_text";
  if (a.has(text.c_str())) table = {name, a.get<std::string>(text.c_str())};
  return table;
}

InputOptions readingOf(const Arguments& a) {
  InputOptions reading;
  reading.swc = {.apply_offset = a.get<bool>("apply_offset"), .strict = a.get<bool>("strict")};
  reading.swc.soma_links = a.get<bool>("soma_links", true);
  tools::readUnit(a.get<std::string>("unit", "um"), reading.swc);
  reading.one_cell_a_file = a.get<bool>("one_cell_a_file");
  reading.versions = tools::morphologyVersion(a.get<std::string>("version", "cng"), "version");
  if (a.has("ids"))
    reading.ids = std::make_shared<const std::vector<std::uint64_t>>(a.get<std::vector<std::uint64_t>>("ids"));
  reading.where = a.get<std::vector<std::string>>("where");
  if (a.has("box")) {
    const py::object box = a.raw("box");
    reading.box_um = {pointArgument("box", box[py::int_(0)]), pointArgument("box", box[py::int_(1)])};
  }
  reading.remote = remoteOf(a);
  return reading;
}

IngestOptions ingestOptionsOf(const Arguments& a) {
  IngestOptions options;
  options.memory = a.get<std::uint64_t>("memory", options.memory);
  if (options.memory < kMinIngestMemory) throw py::value_error("memory: give at least 64MiB");
  const std::uint64_t capacity = a.has("capacity") ? countArgument("capacity", a.raw("capacity"), 0) : options.capacity;
  if (capacity < 1 || capacity > (1u << 30)) throw py::value_error("capacity: give 1 to 2^30 segments");
  options.capacity = static_cast<std::uint32_t>(capacity);
  options.quantum_exponent = a.get<int>("quantum_exponent", options.quantum_exponent);
  if (a.has("threads"))
    options.threads =
        static_cast<unsigned>(std::min<std::uint64_t>(countArgument("threads", a.raw("threads"), 0), 256));
  options.levels = a.get<bool>("levels", true);
  options.force = a.get<bool>("force");
  return options;
}

void tellPython(const py::object& progress, const WorkProgress& told) {
  if (!progress.is_none()) progress(told.phase, told.done, told.total);
}

using Tell = std::function<void(WorkProgress)>;

// Tells the phases of work on sets.
auto phasesTo(const Tell& tell) {
  return [&tell](const char* phase, std::uint64_t done, std::uint64_t total) { tell({phase, done, total}); };
}

// runLong() with the argument `progress`.
void runTold(std::atomic<bool>& cancel, const Arguments& a, const std::function<void(const Tell&)>& work) {
  runLong(cancel, work, [progress = a.raw("progress")](const WorkProgress& told) { tellPython(progress, told); });
}

py::dict setReport(const IngestResult& set) {
  using namespace pybind11::literals;
  return py::dict("revision"_a = set.revision, "cells"_a = set.counts.cells, "samples"_a = set.counts.samples,
                  "segments"_a = set.counts.segments, "tiles"_a = set.counts.tiles, "bytes"_a = set.bytes,
                  "unchanged"_a = set.unchanged);
}

void update(py::dict& to, const py::dict& from) {
  for (const auto& [key, value] : from) to[key] = value;
}

py::dict ingestInputs(const std::vector<std::string>& inputs, const std::string& output, const py::dict& given) {
  const Arguments a(given);
  tools::MakingOrder order{.inputs = inputs, .output = output, .reading = readingOf(a)};
  order.circuit = {a.get<std::string>("population"), a.get<std::string>("morphologies")};
  order.placements = tableOf(a, "placements");
  order.attributes = tableOf(a, "attributes");
  order.key = a.get<std::string>("key");
  order.add = a.get<bool>("add");
  order.sync = a.get<bool>("sync");
  order.remove_gone = a.get<bool>("delete");
  order.remove = a.get<std::vector<std::string>>("remove");
  IngestOptions options = ingestOptionsOf(a);
  tools::checkOrder(order, options.force);
  std::atomic<bool> cancel{false};
  options.cancel = &cancel;
  order.reading.remote.cancel = &cancel;
  tools::MakingResult made;
  runTold(cancel, a, [&](const Tell& tell) {
    order.reading.progress = [&](std::uint64_t done, std::uint64_t total) {
      if (cancel) throw Interrupted("interrupted");
      tell({"read", done, total});
    };
    options.progress = phasesTo(tell);
    made = tools::make(std::move(order), std::move(options));
  });
  using namespace pybind11::literals;
  py::dict result = setReport(made.set);
  update(result, reportsOf(std::move(made.reports)));
  result["summary"] = py::bytes(made.text);
  std::string note;
  for (const std::string& line : made.notes) note += (note.empty() ? "" : "\n") + line;
  result["note"] = py::bytes(note);
  const SyncCounts& counts = made.counts;
  result["changes"] = py::dict("added"_a = counts.added, "changed"_a = counts.changed, "equal"_a = counts.equal,
                               "removed"_a = counts.removed, "gone"_a = counts.gone, "held"_a = counts.held,
                               "renamed"_a = counts.renamed);
  return result;
}

// Cells of an open set as a set of their own; `types`: only these samples.
py::dict ingestCells(SetHandle& handle, std::vector<std::uint32_t> cells, const std::string& types,
                     const std::optional<py::tuple>& box, const std::string& name, const std::string& output,
                     const py::dict& given) {
  const Arguments a(given);
  IngestOptions options = ingestOptionsOf(a);
  const auto open = handle.get();
  const TileSet& set = open->set();
  std::error_code error;
  if (std::filesystem::equivalent(name, output, error))
    throw UsageError("inputs and output are the same tile set " + inShort(output));
  if (!a.has("capacity")) options.capacity = set.capacity();
  if (!a.has("quantum_exponent")) options.quantum_exponent = set.grid().exponent();
  const std::vector<std::uint16_t> codes =
      types.empty() ? std::vector<std::uint16_t>{} : tools::parseSegmentTypes(types, ',', "type");
  std::optional<GridBox> inside;
  if (box) {
    const Vector3d p = pointArgument("box", (*box)[0]), q = pointArgument("box", (*box)[1]);
    inside.emplace(set.grid().snap(p.cwiseMin(q)), set.grid().snap(p.cwiseMax(q)));
  }
  const bool add = a.get<bool>("add");
  if (add && options.force) throw UsageError("--force replaces a set; leave it out with --add");
  std::atomic<bool> cancel{false};
  options.cancel = &cancel;
  IngestResult made;
  runTold(cancel, a, [&](const Tell& tell) {
    const auto check = [&] {
      if (cancel) throw Interrupted("interrupted");
    };
    const unsigned threads = tools::threadsOr(options.threads);
    if (inside) cells = cellsInBox(set, cells, *inside, {.threads = threads, .check = check});
    if (!codes.empty()) cells = cellsWithTypes(set, cells, codes, {.threads = threads, .check = check});
    if (cells.empty()) throw UsageError("no cell of " + inShort(name) + " is chosen");
    options.reading_bytes = options.memory / 4;
    SetCells stream(set, cells,
                    {.types = codes, .memory_bytes = options.reading_bytes, .threads = threads, .check = check});
    options.provenance = [&] { return stream.provenance(); };
    options.progress = phasesTo(tell);
    made = add ? addCells(stream, output, options).set : ingest(stream, output, options);
  });
  return setReport(made);
}

// Reads the inputs as ingest does, and keeps nothing but the reports.
py::dict checkInputs(const std::vector<std::string>& inputs, const py::dict& given) {
  const Arguments a(given);
  InputOptions reading = readingOf(a);
  reading.threads = tools::threadsOr(0);
  const CircuitOptions circuit_options{a.get<std::string>("population"), a.get<std::string>("morphologies")};
  tools::refuseSeveralCircuits(inputs);
  std::atomic<bool> cancel{false};
  reading.remote.cancel = &cancel;
  std::vector<SourceReport> reports;
  std::string doubt, text;
  runTold(cancel, a, [&](const Tell& tell) {
    reading.progress = [&](std::uint64_t done, std::uint64_t total) {
      if (cancel) throw Interrupted("interrupted");
      tell({"read", done, total});
    };
    std::optional<Circuit> circuit;
    if (Circuit::isCircuit(inputs, circuit_options)) circuit.emplace(Circuit::read(inputs.front(), circuit_options));
    Input input = circuit ? Input(circuit->files(), reading) : Input(inputs, reading);
    for (Cell cell; input.next(cell);) continue;
    reports = tools::reportsOf(input, circuit ? &*circuit : nullptr);
    doubt = input.unitDoubt();
    text = summary(reports);
    if (circuit) text += tools::describePopulations(circuit->populationsOf(reports));
  });
  py::dict result = reportsOf(std::move(reports));
  result["summary"] = py::bytes(text);
  result["note"] = py::bytes(doubt);
  return result;
}

py::dict compact(const std::string& path, const py::dict& given) {
  const Arguments a(given);
  IngestOptions options = ingestOptionsOf(a);
  std::atomic<bool> cancel{false};
  options.cancel = &cancel;
  GrowthResult made;
  runTold(cancel, a, [&](const Tell& tell) {
    options.progress = phasesTo(tell);
    made = compactSet(path, options);
  });
  return setReport(made.set);
}

py::tuple verifySet(const std::string& path, bool deep, const std::string& sha256, const py::dict& given) {
  const Arguments a(given);
  std::atomic<bool> cancel{false};
  VerifyOptions options{.deep = deep, .sha256 = lowerCase(sha256), .cancel = &cancel, .remote = remoteOf(a)};
  options.remote.cancel = &cancel;
  VerifyReport report;
  runTold(cancel, a, [&](const Tell& tell) {
    options.progress = phasesTo(tell);
    report = verify(path, options);
  });
  py::list problems;
  for (const std::string& problem : report.problems) problems.append(py::bytes(problem));
  return py::make_tuple(report.tiles, report.bytes, report.problem_count, std::move(problems));
}

std::uint64_t exportOf(SetHandle& handle, const std::vector<std::uint32_t>& cells, const std::string& types,
                       const std::string& output, const std::string& format, const py::dict& given) {
  const Arguments a(given);
  const auto open = handle.get();
  std::atomic<bool> cancel{false};
  tools::CellExport exported{
      .set = open->set(), .name = handle.name(), .cells = cells, .output = output, .format = format, .cancel = &cancel};
  if (!types.empty()) exported.types = tools::parseSegmentTypes(types, ',', "type");
  exported.check = [&] {
    if (cancel) throw Interrupted("interrupted");
  };
  const tools::ExportPlace place = tools::exportPlaceOf(output, format);
  std::uint64_t samples = 0;
  runTold(cancel, a, [&](const Tell& tell) {
    exported.progress = [&](std::uint64_t done) { tell({"export", done, cells.size()}); };
    if (!exported.types.empty())
      exported.cells = cellsWithTypes(open->set(), cells, exported.types, {.check = exported.check});
    samples = tools::exportCells(exported, place);
  });
  return samples;
}

std::uint64_t synth(const std::string& path, std::uint32_t cells, std::uint64_t seed, const std::string& kind,
                    const py::dict& given) {
  const Arguments a(given);
  tools::SyntheticOptions options;
  options.kind = kind;
  options.cells = cells;
  options.seed = seed;
  std::atomic<bool> cancel{false};
  tools::SyntheticSummary made;
  runTold(cancel, a, [&](const Tell& tell) {
    const auto progress = [&](std::uint64_t done, std::uint64_t total) {
      if (cancel) throw Interrupted("interrupted");
      tell({"synth", done, total});
    };
    made = tools::writeSynthetic(options, path, progress, &cancel);
  });
  return made.samples;
}

}  // namespace

void addIngest(py::module_& module) {
  py::class_<RecordReader>(module, "RecordReader")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &RecordReader::next);
  module.def("ingest", &ingestInputs);
  module.def("ingest_cells", &ingestCells);
  module.def("check", &checkInputs);
  module.def("compact", &compact);
  module.def("verify", &verifySet);
  module.def("export", &exportOf);
  module.def("synth", &synth);
}

}  // namespace filiform::python
