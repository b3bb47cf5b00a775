// Measures of real cells against those of NeuroM, which tests/README.md's corpus holds: measures/neurom.tsv.
#include "index/input/input.h"
#include "index/measure/cell_measures.h"
#include "tests/support/corpus.h"
#include "tests/support/scenes/memory_store.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// NeuroM's name, that of Feature, and the largest relative difference. A set rounds positions to 1.95 nm.
struct NeuromName {
  const char* neurom;
  const char* ours;
  double tolerance;
};
constexpr NeuromName kNeuromNames[] = {
    {"soma_radius", "soma_radius", 1e-5},
    {"soma_surface_area", "soma_area", 1e-5},
    {"soma_volume", "soma_volume", 1e-5},
    {"number_of_neurites", "neurites", 0},
    {"trunk_count", "neurites", 0},
    {"number_of_sections", "sections", 0},
    {"number_of_segments", "segments", 0},
    {"number_of_bifurcations", "bifurcations", 0},
    {"number_of_forking_points", "forks", 0},
    {"number_of_leaves", "tips", 0},
    {"total_length", "length", 1e-5},
    {"total_area", "area", 1e-5},
    {"total_volume", "volume", 1e-5},
    {"section_lengths_max", "section_length_max", 1e-5},
    {"section_lengths_mean", "section_length_mean", 1e-5},
    {"section_path_distances_max", "tip_path_max", 1e-5},
    {"terminal_path_lengths_mean", "tip_path_mean", 1e-5},
    {"terminal_path_lengths_max", "tip_path_max", 1e-5},
    {"section_radial_distances_max", "section_radial_max", 1e-5},
    {"max_radial_distance", "tip_radial_max", 1e-5},
    {"section_branch_orders_max", "branch_order_max", 0},
    {"section_strahler_orders_max", "strahler_max", 0},
    {"partition_asymmetry_mean", "asymmetry_mean", 1e-9},
    {"partition_asymmetry_uylings_mean", "asymmetry_uylings_mean", 1e-9},
    {"remote_bifurcation_angles_mean", "remote_angle_mean", 1e-3},
    {"local_bifurcation_angles_mean", "local_angle_mean", 1e-3},
    {"section_tortuosity_mean", "tortuosity_mean", 1e-5},
    {"sibling_ratios_mean", "sibling_ratio_mean", 1e-6},
    {"diameter_power_relations_mean", "diameter_power_mean", 1e-6},
    {"total_width", "width", 1e-5},
    {"total_height", "height", 1e-5},
    {"total_depth", "depth", 1e-5},
};

struct NeuromRow {
  std::string type, feature, value;
};

std::vector<double> numbersOf(const std::string& text) {
  std::vector<double> numbers;
  std::istringstream in(text);
  for (std::string field; std::getline(in, field, ',');) numbers.push_back(std::stod(field));
  return numbers;
}

// The cell of a file, or of an entry `file#name`.
std::optional<Cell> cellIn(const std::string& path) {
  const std::size_t hash = path.find('#');
  Input input({path.substr(0, hash)});
  input.keepFilesWhole();
  for (Cell cell; input.next(cell);) {
    const std::string& name = cell.name.empty() ? cell.source : cell.name;
    if (hash == std::string::npos || name.ends_with(path.substr(hash + 1))) return cell;
  }
  return std::nullopt;
}

// H5 and ASC files give a branch a first point of its own, at the fork, with a radius of its own. The radius is lost.
bool hasOtherRadii(const std::string& file, const std::string& feature) {
  return (file.find(".h5") != std::string::npos || file.ends_with(".asc")) &&
         (feature == "total_area" || feature == "total_volume");
}

// Compares with a table of NeuroM, and counts.
class NeuromComparison {
 public:
  // `widening`: of the tolerances.
  explicit NeuromComparison(double widening) : widening_(widening) {}

  void compare(const std::string& file, const CellTree& tree, const std::vector<NeuromRow>& wanted) {
    const CellMeasures by_type = measuresOf(tree, {.per = MeasurePer::kType, .sholl_um = 10});
    const CellMeasures wide = measuresOf(tree, {.per = MeasurePer::kType, .sholl_um = 50});
    const CellMeasures by_neurite = measuresOf(tree, {.per = MeasurePer::kNeurite});
    for (const NeuromRow& row : wanted) {
      SCOPED_TRACE(row.type + " " + row.feature + " " + row.value);
      if (row.value == "nan" || row.value == "inf" || row.value.starts_with("error:")) {
        ++left_out[row.feature + " " + row.value];
        continue;
      }
      const auto* known = std::find_if(std::begin(kNeuromNames), std::end(kNeuromNames),
                                       [&](const NeuromName& name) { return row.feature == name.neurom; });
      if (hasOtherRadii(file, row.feature)) {
        ++left_out[row.feature + " of H5 and ASC"];
      } else if (known != std::end(kNeuromNames)) {
        ++compared;
        compareNumber(
            findFeature(known->ours)->value(partOf(by_type, row.type), row.type == "soma" ? &by_type.soma : nullptr),
            row.value, known->tolerance);
      } else if (row.feature.starts_with("sholl_frequency")) {
        ++compared;
        compareBins(partOf(row.feature.ends_with("_10") ? by_type : wide, row.type).sholl_by_ends,
                    row.value == "empty" ? std::vector<double>{} : numbersOf(row.value));
      } else if (row.feature.starts_with("principal_direction_extents")) {
        ++compared;
        compareExtents(by_neurite, row);
      } else if (row.feature == "soma_center" && row.value != "none") {
        ++compared;
        const std::vector<double> expected = numbersOf(row.value);
        for (int axis = 0; axis < 3; ++axis)
          EXPECT_NEAR(tree.soma.centre_um[axis], expected[static_cast<std::size_t>(axis)], 2e-3);
      } else {
        ++left_out[row.feature];
      }
    }
  }

  std::size_t compared = 0, bins = 0, other_bins = 0, beyond = 0;
  std::map<std::string, std::size_t> left_out;

 private:
  static Measures partOf(const CellMeasures& cell, const std::string& type) {
    if (type == "all") return cell.all;
    for (const MeasuredPart& part : cell.parts)
      if (part.type == neuriteType(type)) return part.measures;
    return {};
  }

  void compareNumber(double value, const std::string& text, double tolerance) {
    if (text == "empty" || text == "none") {
      EXPECT_TRUE(std::isnan(value)) << value;
      return;
    }
    const double expected = std::stod(text), off = std::abs(value - expected);
    EXPECT_LE(off, widening_ * tolerance * std::abs(expected) + 1e-9) << value;
    beyond += off > tolerance * std::abs(expected) + 1e-9;
  }

  void compareBins(const std::vector<std::uint64_t>& ours, const std::vector<double>& expected) {
    EXPECT_EQ(ours.size(), expected.size());
    for (std::size_t i = 0; i < std::min(ours.size(), expected.size()); ++i, ++bins) {
      const double off = std::abs(static_cast<double>(ours[i]) - expected[i]);
      EXPECT_LE(off, widening_ > 1 ? 2 : 0) << i;
      other_bins += off > 0;
    }
  }

  static void compareExtents(const CellMeasures& by_neurite, const NeuromRow& row) {
    std::vector<double> expected = numbersOf(row.value), ours;
    for (const MeasuredPart& part : by_neurite.parts)
      if (row.type == "all" || part.type == neuriteType(row.type))
        ours.push_back(part.measures.extents_um[static_cast<std::size_t>(row.feature.back() - '0')].most);
    ASSERT_EQ(ours.size(), expected.size());
    std::sort(ours.begin(), ours.end());
    std::sort(expected.begin(), expected.end());
    for (std::size_t i = 0; i < ours.size(); ++i) EXPECT_NEAR(ours[i], expected[i], 1e-3 * expected.back() + 1e-6);
  }

  double widening_;
};

std::map<std::string, std::vector<NeuromRow>> neuromTable() {
  std::map<std::string, std::vector<NeuromRow>> rows;
  std::ifstream table(*test::corpusFolder() / "measures" / "neurom.tsv");
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream in(line);
    std::string file;
    NeuromRow row;
    std::getline(in, file, '\t');
    std::getline(in, row.type, '\t');
    std::getline(in, row.feature, '\t');
    std::getline(in, row.value, '\t');
    rows[file].push_back(row);
  }
  return rows;
}

// As read, to the tolerances. In a set, positions lie on a grid of 1.95 nm, which moves the values of cells with
// segments of 0.1 um further; counts stay equal.
TEST(CellMeasures, AreThoseOfNeurom) {
  FILIFORM_NEEDS_CORPUS();
  NeuromComparison as_read(1), in_set(1000);
  for (const auto& [file, wanted] : neuromTable()) {
    SCOPED_TRACE(file);
    const std::optional<Cell> cell = cellIn((*test::corpusFolder() / file).string());
    if (!cell) {
      as_read.left_out["no cell"] += wanted.size();
      continue;
    }
    as_read.compare(file, treeOf(*cell), wanted);
    in_set.compare(file, treeOf(readCell(*test::storeOf({*cell}), 0, true)), wanted);
  }
  for (const NeuromComparison* c : {&as_read, &in_set})
    std::cout << c->compared << " values compared, " << c->beyond << " beyond the tolerance; of " << c->bins
              << " bins of Sholl " << c->other_bins << " differ\n";
  for (const auto& [what, count] : as_read.left_out) std::cout << "left out: " << what << " " << count << "\n";
}

}  // namespace
}  // namespace filiform
