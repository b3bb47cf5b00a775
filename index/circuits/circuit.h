// Circuit: the neurons of a SONATA circuit, or of one file of nodes, as a table that places morphologies.
//
// A node is placed at x, y, z, in um, turned by its quaternion (orientation_w, _x, _y, _z: local to world, normalised
// here) or by angles about the world's axes z, then y, then x. The soma of its morphology is moved to the origin first,
// unless `recenter` is 0. The cell is named POPULATION/NODE, and keeps the node's attributes. Populations without
// morphologies are counted. Populations of type `vasculature` become one graph each.
//
//   Circuit circuit = Circuit::read("circuit_config.json", {});
//   Input library(circuit.files(), options);
//   CircuitCells cells(library, circuit);
//   ingest(cells, "column.fil");
#pragma once

#include "index/cell/cell.h"
#include "index/circuits/circuit_config.h"
#include "index/circuits/placements.h"
#include "index/input/input.h"

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace filiform {

struct CircuitOptions {
  std::string population;    // read only this one; empty: all
  std::string morphologies;  // for a file of nodes: a folder or an H5 container; in a circuit, replaces what it states
};

// What became of one population.
struct PopulationReport {
  std::string file, name, type;  // type: as the circuit states it
  std::uint64_t nodes = 0;
  std::uint64_t placed = 0;            // nodes with a morphology
  std::uint64_t missing = 0;           // nodes whose morphology is not there
  std::uint64_t without = 0;           // nodes without one: NULL, or no attribute `morphology` or `morphology_file`
  bool vasculature = false;            // read as a graph
  Vector3d mean_y = Vector3d::Zero();  // mean direction of the local y axis, over the placed nodes
  std::vector<std::string> skipped;    // attributes that are left out, and why
  std::uint64_t refused = 0;           // nodes whose morphology was refused; see Circuit::populationsOf()
};

// Thread rule: immutable once made.
class Circuit {
 public:
  // Populations with fewer than this many placed nodes may point anywhere.
  static constexpr std::uint64_t kFewNodes = 10;
  static constexpr double kLeastMean = 0.5;  // a mean direction shorter than this is doubtful

  // True for arguments that read() takes: a circuit_config.json, or an .h5 file when morphologies are given.
  static bool isCircuit(const std::vector<std::string>& arguments, const CircuitOptions& options);
  // Reads a circuit_config.json, or an .h5 file of nodes. Throws IoError if a file cannot be read. Throws InputError
  // naming file, population and node for: an unknown population, a morphology place that is missing, a quaternion of
  // length 0, a position that is missing or not finite, an attribute of the wrong type, a circuit that places no node.
  // O(values).
  static Circuit read(const std::string& path, const CircuitOptions& options);

  const PlacementTable& table() const { return table_; }
  // The files of morphologies that the table places, for Input. Their names are paths below the circuit's folder.
  const std::vector<InputFile>& files() const { return files_; }
  // Before morphologies are read: some that are placed may then be refused.
  const std::vector<PopulationReport>& populations() const { return populations_; }
  // The same with the reports on the morphologies: nodes of refused ones are not placed.
  std::vector<PopulationReport> populationsOf(const std::vector<SourceReport>& reports) const;
  const std::vector<Cell>& graphs() const { return graphs_; }  // vasculature, ascending by source
  // The reports on graphs, one a source.
  const std::vector<SourceReport>& graphReports() const { return graph_reports_; }
  // One line a population whose mean direction is doubtful: its rotations may be of another convention.
  std::vector<std::string> doubts() const;

 private:
  friend class CircuitCells;
  struct Reader;
  PlacementTable table_;
  std::vector<InputFile> files_;
  std::vector<PopulationReport> populations_;
  std::vector<std::map<std::string, std::uint64_t>> placed_of_;  // by population: nodes of each source
  std::vector<Cell> graphs_;
  std::vector<SourceReport> graph_reports_;
};

// The placed cells and the graphs of a circuit, in the order of ids. Thread rule: thread-compatible.
class CircuitCells final : public CellStream {
 public:
  // Both must outlive this object. Takes the circuit's table out of it. Throws as PlacedCells.
  CircuitCells(Input& library, Circuit& circuit) : circuit_(circuit), placed_(library, std::move(circuit.table_)) {}
  bool next(Cell& cell) override;
  const PlacedCells& placed() const { return placed_; }
  PlacedCells& placed() { return placed_; }
  // As PlacedCells::keepPart(), with the graphs.
  void keepPart(unsigned part, unsigned count);

 private:
  const Circuit& circuit_;
  PlacedCells placed_;
  std::size_t next_graph_ = 0, end_graph_ = SIZE_MAX;
  std::optional<Cell> waiting_;
  bool ended_ = false;
};

}  // namespace filiform
