#include "tools/synthetic/synthetic.h"

#include "index/errors.h"
#include "index/export/zip_writer.h"
#include "index/output.h"
#include "index/text.h"
#include "tools/synthetic/synthetic_fan.h"
#include "tools/synthetic/synthetic_neuron.h"
#include "tools/synthetic/synthetic_swc.h"
#include "tools/synthetic/synthetic_trace.h"
#include "tools/synthetic/thousandths.h"
#include "tools/words/near_names.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <optional>
#include <utility>

namespace filiform::tools {

namespace {

// The radius within which a table places cells: 31 000 of them fill 0.29 mm^3, a column of rat cortex.
constexpr double kPlacedRadius_um = 257;

struct Entry {
  std::string path;
  std::uint64_t number;  // number of the cell
};

constexpr int kFanBranches[] = {3, 5, 7, 10};  // fans take these numbers in turn

bool isOneOf(const std::vector<std::string>& kinds, const std::string& kind) {
  return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

bool isScene(const std::string& kind) { return isOneOf(sceneKinds(), kind) || isOneOf(hardSceneKinds(), kind); }

Fan fanOf(std::uint64_t seed, std::uint64_t number) {
  return buildFan(drawFan(seed, number, kFanBranches[number % std::size(kFanBranches)]));
}

std::string padded(std::uint64_t number, std::size_t width) {
  std::string digits = std::to_string(number);
  digits.insert(0, width - digits.size(), '0');
  return digits;
}

[[noreturn]] void refuseKind(const char* what, const std::string& given, const std::vector<std::string>& kinds) {
  NearNames near(given);
  for (const std::string& kind : kinds) near.offer(kind);
  throw UsageError(std::string("no such ") + what + " '" + escaped(given, 80) + "'; choose " + kindList(kinds) +
                   didYouMean(near.names()));
}

// The files of a column, a family or a scene, and the text of each file.
class Plan {
 public:
  explicit Plan(const SyntheticOptions& options) : options_(options) {
    if (!isOneOf(syntheticKinds(), options.kind)) refuseKind("kind", options.kind, syntheticKinds());
    if (isScene(options.kind)) {
      entries_.push_back({options.kind + ".swc", 0});
      return;
    }
    if (options.cells == 0) throw UsageError("a " + options.kind + " needs at least one cell");
    const std::size_t width = std::max<std::size_t>(5, std::to_string(options.cells - 1).size());
    if (options.kind == "fan") {
      for (std::uint64_t i = 0; i < options.cells; ++i) entries_.push_back({"fan/fan_" + padded(i, width) + ".swc", i});
      return;
    }
    if (options.kind == "traces") {
      for (std::uint64_t i = 0; i < options.cells; ++i)
        entries_.push_back({(i % 2 == 0 ? "traces/lattice_" : "traces/depth_") + padded(i, width) + ".swc", i});
      return;
    }
    library_ = !options.placements_out.empty();
    if (library_ && options.library == 0) throw UsageError("a library needs at least one morphology");
    const std::uint64_t files = library_ ? std::min(options.cells, options.library) : options.cells;
    for (std::uint64_t i = 0; i < files; ++i)
      entries_.push_back({(library_ ? "library/L" : "column/L") + std::to_string(layerOfCell(options.seed, i)) +
                              "/cell_" + padded(i, width) + ".swc",
                          i});
    std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) { return a.path < b.path; });
  }

  const std::vector<Entry>& entries() const { return entries_; }

  Neuron neuron(const Entry& entry) const {
    std::uint32_t tip = 0;
    if (options_.kind == "fan") return fanOf(options_.seed, entry.number).neuron;
    if (options_.kind == "traces") return drawTrace(options_.seed, entry.number);
    return isScene(options_.kind) ? buildScene(options_.kind, tip) : growNeuron(options_.seed, entry.number, library_);
  }

  std::string text(const Entry& entry, const Neuron& neuron) const {
    if (options_.kind == "fan") return fanOf(options_.seed, entry.number).text;
    std::vector<std::string> comments{neuron.description};
    if (isScene(options_.kind)) {
      comments.push_back("suggested route (sample ids ROOT:TIP): " + sceneRoute(options_.kind));
    } else {
      comments.push_back("cell " + std::to_string(entry.number) + ", seed " + std::to_string(options_.seed));
      comments.emplace_back(
          "micrometres; y points up: white matter at 0, pia at 1400; the column is 300 wide around x = z = 0");
      comments.emplace_back("types: 1 soma, 2 axon, 3 basal or multipolar dendrite, 4 apical dendrite");
    }
    return swcText(neuron, comments);
  }

 private:
  SyntheticOptions options_;
  bool library_ = false;
  std::vector<Entry> entries_;
};

std::uint64_t segmentsOf(const Neuron& neuron) {
  return static_cast<std::uint64_t>(std::count_if(neuron.samples.begin(), neuron.samples.end(),
                                                  [](const NeuronSample& s) { return s.parent != kNoParent; }));
}

SyntheticSummary writeArchive(const Plan& plan, const std::string& path, const std::string& out_zip,
                              const SyntheticProgress& progress) {
  SyntheticSummary summary;
  Neuron neuron;  // of the last text() call
  ZipContent content;
  content.entries = plan.entries().size();
  content.name = [&](std::size_t i) { return plan.entries()[i].path; };
  content.text = [&](std::size_t i) {
    neuron = plan.neuron(plan.entries()[i]);
    return plan.text(plan.entries()[i], neuron);
  };
  content.written = [&](std::uint64_t bytes) {
    ++summary.files;
    summary.samples += neuron.samples.size();
    summary.segments += segmentsOf(neuron);
    summary.text_bytes += bytes;
    if (progress) progress(summary.files, content.entries);
  };
  summary.zip_bytes = writeZip(path, out_zip, content);
  return summary;
}

// The table that places the morphologies of a library: rotated about the vertical axis, spread over the column, at
// nearly the same depth.
std::string placementTable(const SyntheticOptions& options, const Plan& plan, const std::string& archive) {
  std::vector<const Entry*> by_number(plan.entries().size());
  for (const Entry& entry : plan.entries()) by_number[entry.number] = &entry;
  std::string out = "source\tx_um\ty_um\tz_um\tqw\tqx\tqy\tqz\tname\n";
  const std::size_t width = std::max<std::size_t>(5, std::to_string(options.cells - 1).size());
  for (std::uint64_t i = 0; i < options.cells; ++i) {
    SyntheticRandom random(options.seed ^ 0x706c616365U, i);
    const Vector3d p = kPlacedRadius_um * random.inDisc();
    Vector3d turn = random.inDisc();
    while (turn.squaredNorm() < 0.01) turn = random.inDisc();
    turn.normalize();
    out += archive + "/" + by_number[i % by_number.size()]->path;
    for (const double coordinate : {p.x(), random.between(-6, 0), p.z()}) {
      out += '\t';
      appendThousandths(out, std::llround(coordinate * 1000));
    }
    for (const double component : {turn.x(), 0.0, turn.z(), 0.0}) {
      char digits[32];
      out += '\t';
      out.append(digits, std::to_chars(digits, digits + sizeof digits, component).ptr);
    }
    out += "\tcell_" + padded(i, width) + "\n";
  }
  return out;
}

}  // namespace

const std::vector<std::string>& syntheticKinds() {
  static const std::vector<std::string> kKinds{"column", "traces", "fan", "scene1",  "scene2", "scene3",
                                               "elbows", "hooks",  "hub", "bouquet", "coil",   "meander"};
  return kKinds;
}

const std::vector<std::string>& hardSceneKinds() {
  static const std::vector<std::string> kKinds{"hub", "bouquet", "coil", "meander"};
  return kKinds;
}

const std::vector<std::string>& sceneKinds() {
  static const std::vector<std::string> kKinds{"scene1", "scene2", "scene3", "elbows", "hooks"};
  return kKinds;
}

std::string kindList(const std::vector<std::string>& kinds) {
  std::string list = kinds.front();
  for (std::size_t i = 1; i < kinds.size(); ++i) list += (i + 1 == kinds.size() ? " or " : ", ") + kinds[i];
  return list;
}

std::string sceneRoute(const std::string& kind) {
  if (!isScene(kind)) {
    std::vector<std::string> kinds = sceneKinds();
    kinds.insert(kinds.end(), hardSceneKinds().begin(), hardSceneKinds().end());
    refuseKind("scene", kind, kinds);
  }
  std::uint32_t tip = 0;
  buildScene(kind, tip);
  return "1:" + std::to_string(tip + 1);
}

SyntheticSummary writeSynthetic(const SyntheticOptions& options, const std::string& out_zip,
                                const SyntheticProgress& progress, const std::atomic<bool>* cancel) {
  const Plan plan(options);
  const bool table = !options.placements_out.empty() && options.kind == "column";
  // Both outputs are opened before the work, so that a name that cannot be written fails at once.
  Output archive(out_zip, {.by_name = true, .cancel = cancel});
  std::optional<Output> placed;
  if (table) {
    placed.emplace(options.placements_out, OutputOptions{.cancel = cancel});
    placed->write(placementTable(options, plan, std::filesystem::path(out_zip).filename().string()));
  }
  SyntheticSummary summary = writeArchive(plan, archive.partialPath(), out_zip, progress);
  summary.cells = table ? options.cells : summary.files;
  archive.finish();
  if (placed) placed->finish();
  return summary;
}

struct SyntheticCells::Impl {
  Impl(const SyntheticOptions& options, std::string before) : plan(options), prefix(std::move(before)) {
    if (!prefix.empty()) prefix += '/';
  }

  Plan plan;
  std::string prefix;
  std::size_t next = 0;
};

SyntheticCells::SyntheticCells(const SyntheticOptions& options, std::string archive) {
  SyntheticOptions without_table = options;
  without_table.placements_out.clear();
  impl_ = std::make_unique<Impl>(without_table, std::move(archive));
}

SyntheticCells::~SyntheticCells() = default;

std::uint64_t SyntheticCells::cells() const { return impl_->plan.entries().size(); }

bool SyntheticCells::next(Cell& cell) {
  if (impl_->next == impl_->plan.entries().size()) return false;
  const Entry& entry = impl_->plan.entries()[impl_->next++];
  const Neuron neuron = impl_->plan.neuron(entry);
  cell = cellOf(neuron, impl_->plan.text(entry, neuron), impl_->prefix + entry.path);
  return true;
}

}  // namespace filiform::tools
