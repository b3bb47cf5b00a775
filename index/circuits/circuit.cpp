#include "index/circuits/circuit.h"

#include "index/circuits/internal/node_table.h"
#include "index/errors.h"
#include "index/formats/internal/graph_builder.h"
#include "index/formats/internal/h5_morphology.h"
#include "index/text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>
#include <tuple>
#include <utility>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using internal::NodeTable;
using Quaternion = std::array<double, 4>;

constexpr double kLeastLength = 1e-12;                            // of a quaternion
constexpr std::string_view kOlderMorphology = "morphology_file";  // of circuits before the specification of 2019
constexpr std::string_view kEndings[] = {".swc", ".h5", ".asc"};

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

// The rotation of a node, local to world.
Quaternion turnOf(const NodeTable& table, std::uint64_t node) {
  static constexpr std::string_view kQuaternion[] = {"orientation_w", "orientation_x", "orientation_y",
                                                     "orientation_z"};
  static constexpr std::string_view kAngles[] = {"rotation_angle_xaxis", "rotation_angle_yaxis",
                                                 "rotation_angle_zaxis"};
  Quaternion q{};
  std::size_t given = 0;
  for (std::size_t i = 0; i < 4; ++i)
    if (const auto value = table.number(kQuaternion[i], node)) q[i] = *value, ++given;
  if (given > 0 && given < 4)
    table.fail(node, "has " + std::to_string(given) + " of the four orientation_w, _x, _y, _z");
  if (given == 4) {
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length >= kLeastLength) || !std::isfinite(length))
      table.fail(node, "its quaternion has length " + std::to_string(length) + ", so it is no rotation");
    for (double& component : q) component = component / length + 0.0;
    return q;
  }
  Quaternion turn{1, 0, 0, 0};
  for (std::size_t axis = 0; axis < 3; ++axis) {  // Rx Ry Rz: about the world's z first, then y, then x
    const double angle = table.number(kAngles[axis], node).value_or(0);
    if (!std::isfinite(angle)) table.fail(node, std::string(kAngles[axis]) + " is not finite");
    Quaternion about{std::cos(angle / 2), 0, 0, 0};
    about[axis + 1] = std::sin(angle / 2);
    turn = product(turn, about);
  }
  for (double& component : turn) component += 0.0;
  return turn;
}

std::string shownBelow(const std::string& path, const std::string& folder) {
  const fs::path shown = fs::path(path).lexically_relative(folder.empty() ? "." : folder);
  return shown.empty() ? path : shown.string();
}

bool hasKnownEnding(const std::string& name) {
  return std::any_of(std::begin(kEndings), std::end(kEndings),
                     [&](std::string_view ending) { return endsWithNoCase(name, ending); });
}

bool leadsOut(const std::string& name) {
  const fs::path path = name;
  return path.is_absolute() || std::any_of(path.begin(), path.end(), [](const fs::path& part) { return part == ".."; });
}

// Attributes of rows that stand for nodes of some populations.
class NodeAttributes final : public RowAttributes {
 public:
  void addTable(std::shared_ptr<const NodeTable> table) { tables_.push_back(std::move(table)); }
  void addRow(std::uint64_t node) {
    rows_.push_back({static_cast<std::uint32_t>(tables_.size() - 1), static_cast<std::uint32_t>(node)});
  }
  void of(std::uint32_t row, std::vector<CellAttribute>& attributes) const override {
    attributes.clear();
    tables_[rows_[row].table]->attributesOf(rows_[row].node, attributes);
  }
  std::uint64_t held_bytes() const override {
    std::uint64_t sum = rows_.capacity() * sizeof(Row);
    for (const auto& table : tables_) sum += table->held_bytes();
    return sum;
  }

 private:
  struct Row {
    std::uint32_t table, node;
  };
  std::vector<std::shared_ptr<const NodeTable>> tables_;
  std::vector<Row> rows_;
};

}  // namespace

struct Circuit::Reader {
  struct Source {
    std::string shown;
    bool missing = false;
  };

  explicit Reader(const CircuitOptions& circuit_options) : options(circuit_options) {}

  void readConfig(const std::string& path) {
    const CircuitConfig config = readCircuitConfig(path);
    folder = config.folder;
    start(path);
    std::string known;
    bool found = options.population.empty();
    for (CircuitPopulation population : config.populations) {
      if (!options.morphologies.empty()) population.morphologies = placesAt(options.morphologies);
      std::vector<std::string> names{population.name};
      if (population.name.empty()) names = populationsOf(population.nodes_file);
      for (const std::string& name : names) {
        known += (known.empty() ? "" : ", ") + escaped(name, 100);
        if (!options.population.empty() && options.population != name) continue;
        found = true;
        population.name = name;
        readPopulation(population);
      }
    }
    if (!found)
      throw InputError(inShort(path) + ": has no population " + escaped(options.population, 100) + "; it has " +
                       escaped(known, 600));
    finish();
  }

  void readNodes(const std::string& path) {
    folder = fs::path(path).parent_path().string();
    start(path);
    CircuitPopulation population;
    population.nodes_file = path;
    population.morphologies = placesAt(options.morphologies);
    std::vector<std::string> names{options.population};
    if (options.population.empty()) names = populationsOf(path);
    if (names.empty()) throw InputError(inShort(path) + ": holds no population of nodes");
    for (const std::string& name : names) {
      population.name = name;
      readPopulation(population);
    }
    finish();
  }

  void start(const std::string& path) { circuit.table_ = {fs::path(path).filename().string(), bytesOf(path)}; }

  static std::uint64_t bytesOf(const std::string& path) {
    std::error_code error;
    const std::uint64_t bytes = fs::file_size(path, error);
    if (error) throw IoError(inShort(path), "cannot read", error.value());
    return bytes;
  }

  // Runs `read`. What it cannot read in a file that is there is a fault of the input.
  template <typename Read>
  static auto readable(const std::string& file, Read read) {
    bytesOf(file);
    try {
      return read();
    } catch (const IoError& failure) {
      if (failure.isShortage()) throw;
      throw InputError(failure.what());
    }
  }
  std::vector<std::string> populationsOf(const std::string& file) {
    return readable(file, [&] { return internal::listPopulations(process, file); });
  }

  // The places of --morphologies: a folder may hold files of any format.
  static MorphologyPlaces placesAt(const std::string& path) {
    std::error_code error;
    if (!fs::exists(path, error)) throw IoError(inShort(path), "no such file or folder");
    if (fs::is_directory(path, error)) return {path, "", ""};
    return {"", path, ""};
  }

  // Where the morphologies of a population are read: the first place that exists.
  struct Place {
    std::string path;
    bool container = false;
    std::vector<std::string_view> endings;
  };
  Place placeOf(const CircuitPopulation& population) const {
    const MorphologyPlaces& places = population.morphologies;
    std::error_code error;
    std::string missing;
    for (const auto& [path, ending] : {std::pair<std::string, std::string_view>{places.swc_folder, ".swc"},
                                       {places.h5, ".h5"},
                                       {places.asc_folder, ".asc"}}) {
      if (path.empty()) continue;
      if (fs::is_directory(path, error))
        return {path, false,
                ending == ".swc" ? std::vector<std::string_view>{".swc", ".h5", ".asc"} : std::vector{ending}};
      if (ending == ".h5" && fs::is_regular_file(path, error)) return {path, true, {}};
      missing += (missing.empty() ? "" : ", ") + escaped(path, 300);
    }
    if (missing.empty())
      throw InputError(inShort(population.nodes_file) + ": population " + escaped(population.name, 200) +
                       ": no place of morphologies is stated; give one with --morphologies");
    throw IoError(missing, "no such file or folder: the morphologies of population " + escaped(population.name, 200));
  }

  void readPopulation(const CircuitPopulation& population) {
    PopulationReport report;
    report.file = shownBelow(population.nodes_file, folder);
    report.name = population.name;
    report.type = population.type;
    if (!population.node_types_file.empty()) bytesOf(population.node_types_file);
    const auto table = readable(population.nodes_file, [&] {
      return std::make_shared<NodeTable>(process, population.nodes_file, population.name, population.node_types_file);
    });
    circuit.placed_of_.emplace_back();
    report.nodes = table->nodes();
    report.skipped = table->skipped();
    if (population.type == "vasculature") {
      report.vasculature = true;
      readVasculature(*table, report);
    } else if (!(table->has("morphology") || table->has(kOlderMorphology)) || population.type == "virtual") {
      report.without = report.nodes;
    } else {
      placeNodes(population, table, report);
    }
    circuit.populations_.push_back(std::move(report));
  }

  void placeNodes(const CircuitPopulation& population, const std::shared_ptr<NodeTable>& table,
                  PopulationReport& report) {
    std::optional<Place> place;  // asked for at the first node that needs it
    std::map<std::string, std::uint64_t>& placed_of = circuit.placed_of_.back();
    attributes->addTable(table);
    for (std::uint64_t node = 0; node < table->nodes(); ++node) {
      std::string morphology = table->text("morphology", node);
      if (morphology.empty()) morphology = table->text(kOlderMorphology, node);
      if (morphology.empty() || morphology == "NULL") {
        ++report.without;
        continue;
      }
      if (!place) place = placeOf(population);
      if (leadsOut(morphology))
        table->fail(node, "its morphology '" + escaped(morphology, 200) + "' leads out of the folder of morphologies");
      std::array<double, 3> moved{};
      static constexpr std::string_view kAxes[] = {"x", "y", "z"};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto value = table->number(kAxes[axis], node);
        if (!value || !std::isfinite(*value)) table->fail(node, std::string(kAxes[axis]) + " is missing or not finite");
        moved[axis] = *value + 0.0;
      }
      const Quaternion turn = turnOf(*table, node);
      const Source& source = sourceOf(*place, morphology);
      if (source.missing) {
        ++report.missing;
        if (first_missing.empty()) first_missing = source.shown;
      } else {
        const auto [w, x, y, z] = turn;
        report.mean_y += Vector3d(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x));
        ++report.placed;
        ++placed_of[source.shown];
      }
      circuit.table_.add(source.shown, population.name + "/" + std::to_string(node),
                         static_cast<std::uint32_t>(node + 1), moved, turn, table->number("recenter", node) != 0.0);
      attributes->addRow(node);
    }
    if (report.placed > 0) report.mean_y /= static_cast<double>(report.placed);
  }

  // The source of a morphology, whose file is added to those that are read.
  const Source& sourceOf(const Place& place, const std::string& morphology) {
    Source& source = sources[{place.path, morphology}];
    if (!source.shown.empty()) return source;
    if (place.container) {
      auto [names, is_new] = held.try_emplace(place.path);
      if (is_new)
        names->second = readable(place.path, [&] { return internal::listH5Morphologies(process, place.path); });
      containers[place.path].insert(morphology);
      const bool single = names->second.size() == 1 && names->second.front().empty();
      source.missing = !single && !std::binary_search(names->second.begin(), names->second.end(), morphology);
      source.shown = shownBelow(place.path, folder) + "/" + morphology;
      return source;
    }
    std::string path = place.path + "/" + morphology;
    std::error_code error;
    if (!hasKnownEnding(morphology) || !fs::exists(path, error)) {
      const std::string bare = path;
      if (!hasKnownEnding(morphology)) path += place.endings.front();  // reported if none exists
      for (const std::string_view ending : place.endings)
        if (const std::string named = bare + std::string(ending); fs::exists(named, error)) {
          path = named;
          break;
        }
    }
    source = {shownBelow(path, folder), !fs::exists(path, error)};
    files.emplace(path, source.shown);
    return source;
  }

  // Segments from start to end, whose ends are the nodes start_node and end_node.
  void readVasculature(const NodeTable& table, PopulationReport& report) {
    internal::GraphBuilder graph{SwcOptions{}};
    std::set<std::int64_t> known;
    const auto end = [&](const std::string& side, std::uint64_t node) {
      const auto id = table.number(side + "_node", node);
      if (!id || *id < 0 || *id != std::floor(*id)) table.fail(node, side + "_node is missing or no whole number");
      const auto number = static_cast<std::int64_t>(*id);
      if (known.insert(number).second) {
        Vector3d p;
        static constexpr std::string_view kAxes[] = {"_x", "_y", "_z"};
        for (int axis = 0; axis < 3; ++axis) {
          const auto value = table.number(side + std::string(kAxes[axis]), node);
          if (!value) table.fail(node, side + std::string(kAxes[axis]) + " is missing");
          p[axis] = *value;
        }
        const double diameter = table.number(side + "_diameter", node).value_or(std::nan(""));
        const double type = table.number("type", node).value_or(0);
        graph.node(number, p, diameter / 2, type >= 0 && type <= UINT16_MAX ? static_cast<std::uint16_t>(type) : 0,
                   node + 1, "");
      }
      return number;
    };
    for (std::uint64_t node = 0; node < table.nodes(); ++node) {
      const std::int64_t from = end("start", node), to = end("end", node);
      graph.link(from, to, node + 1);
    }
    Cell cell;
    SourceReport row;
    row.file = report.file + "/" + report.name;
    row.report = graph.finish(row.file, cell);
    cell.source = row.file;
    cell.name = report.name;
    cell.digest = table.nodes();
    cell.attributes = {{"population", report.name}};
    if (row.report.severity != Severity::kRefuse) circuit.graphs_.push_back(std::move(cell));
    circuit.graph_reports_.push_back(std::move(row));
  }

  void finish() {
    PopulationReport all;
    for (const PopulationReport& population : circuit.populations_) {
      all.nodes += population.nodes;
      all.placed += population.placed;
      all.missing += population.missing;
    }
    if (all.placed == 0 && circuit.graph_reports_.empty())
      throw InputError(escaped(circuit.table_.file()) + ": places none of its " + std::to_string(all.nodes) +
                       " nodes: " +
                       (all.missing > 0 ? "the morphologies of " + std::to_string(all.missing) +
                                              " are missing, the first is " + escaped(first_missing, 200)
                                        : "none has a morphology (attribute morphology or morphology_file)"));
    for (const auto& [path, names] : containers)
      circuit.files_.push_back({path, shownBelow(path, folder), std::vector<std::string>(names.begin(), names.end())});
    for (const auto& [path, shown] : files) circuit.files_.push_back({path, shown, std::nullopt});
    circuit.table_.setAttributes(attributes);
    std::stable_sort(circuit.graphs_.begin(), circuit.graphs_.end(),
                     [](const Cell& a, const Cell& b) { return a.source < b.source; });
  }

  const CircuitOptions& options;
  Circuit circuit;
  internal::Hdf5Process process;
  std::string folder;
  std::shared_ptr<NodeAttributes> attributes = std::make_shared<NodeAttributes>();
  std::map<std::pair<std::string, std::string>, Source> sources;  // by place and morphology
  std::map<std::string, std::set<std::string>> containers;        // by path: the morphologies needed
  std::map<std::string, std::vector<std::string>> held;           // by path: the morphologies there, ascending
  std::map<std::string, std::string> files;                       // by path: the name shown
  std::string first_missing;
};

bool Circuit::isCircuit(const std::vector<std::string>& arguments, const CircuitOptions& options) {
  if (arguments.size() != 1) return false;
  if (endsWithNoCase(arguments[0], ".h5")) return !options.morphologies.empty() || !options.population.empty();
  return isCircuitConfig(arguments[0]);
}

Circuit Circuit::read(const std::string& path, const CircuitOptions& options) {
  Reader reader(options);
  if (endsWithNoCase(path, ".h5"))
    reader.readNodes(path);
  else
    reader.readConfig(path);
  return std::move(reader.circuit);
}

std::vector<PopulationReport> Circuit::populationsOf(const std::vector<SourceReport>& reports) const {
  std::vector<PopulationReport> all = populations_;
  auto placed_of = placed_of_;
  forEachInput(reports, [&](const std::string& input, const InputReport&, const InputOutcome& outcome) {
    if (!outcome.isLost()) return;
    for (std::size_t i = 0; i < all.size(); ++i)
      std::erase_if(placed_of[i], [&](const auto& nodes) {  // the morphology, or all of a container
        const bool is_lost = nodes.first == input || nodes.first.starts_with(input + "/");
        if (is_lost) all[i].placed -= nodes.second, all[i].refused += nodes.second;
        return is_lost;
      });
  });
  return all;
}

std::vector<std::string> Circuit::doubts() const {
  std::vector<std::string> lines;
  for (const PopulationReport& report : populations_) {
    if (report.placed < kFewNodes || report.mean_y.norm() >= kLeastMean) continue;
    std::array<char, 32> length{};
    std::snprintf(length.data(), length.size(), "%.2f", report.mean_y.norm());
    lines.push_back("population " + escaped(report.name, 200) + ": the mean direction of the local y axis has length " +
                    length.data() + ", below 0.5: the rotations may follow another convention");
  }
  return lines;
}

void CircuitCells::keepPart(unsigned part, unsigned count) {
  const PlacedCells::Sources range = placed_.keepPart(part, count);
  const std::vector<Cell>& graphs = circuit_.graphs();
  while (next_graph_ < graphs.size() && !range.contain(graphs[next_graph_].source)) ++next_graph_;
  for (end_graph_ = next_graph_; end_graph_ < graphs.size() && range.contain(graphs[end_graph_].source);) ++end_graph_;
}

bool CircuitCells::next(Cell& cell) {
  if (!waiting_ && !ended_) {
    waiting_.emplace();
    std::swap(*waiting_, cell);
    if (!placed_.next(*waiting_)) {
      ended_ = true;
      waiting_.reset();
    }
  }
  const std::vector<Cell>& graphs = circuit_.graphs();
  if (next_graph_ < std::min(end_graph_, graphs.size()) &&
      (!waiting_ || graphs[next_graph_].source < waiting_->source)) {
    cell = graphs[next_graph_++];
    return true;
  }
  if (!waiting_) return false;
  std::swap(cell, *waiting_);
  waiting_.reset();
  return true;
}

}  // namespace filiform
