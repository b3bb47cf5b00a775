// Figures of a circuit: of a set, and of an independent reading by h5py and numpy.
#pragma once

#include "index/query/cell_graph.h"
#include "index/set/tile_set.h"
#include "tests/support/folders.h"
#include "tests/support/process.h"
#include "tests/support/scenes/small_circuit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::test {

// The figures that h5py and numpy compute; null without them.
inline nlohmann::json figuresOf(const std::string& config) {
  const std::string script = inSource("tests/tools/commands/circuit_figures.py");
  const std::string out = outputOf("/usr/bin/python3 '" + script + "' '" + config + "' 2>/dev/null");
  return out.empty() ? nlohmann::json() : nlohmann::json::parse(out);
}

struct Figures {
  std::uint64_t cells = 0, segments = 0;
  double length_um = 0;
  Vector3d lo_um = Vector3d::Zero(), hi_um = Vector3d::Zero();
};

// Of the set's samples as they are stored.
inline Figures figuresOfSet(const std::string& path) {
  const auto set = TileSet::open(path);
  Figures f;
  f.cells = set->counts().cells;
  f.segments = set->counts().segments;
  for (std::uint32_t c = 0; c < set->cell_count(); ++c) {
    const CellGraph graph = readCell(*set, c, false);
    for (std::uint32_t i = 0; i < graph.samples(); ++i)
      if (graph.parents[i] != kNoParent)
        f.length_um += (graph.position_W(i) - graph.position_W(graph.parents[i])).norm();
  }
  f.lo_um = set->grid().toWorld(set->bounds().lo);
  f.hi_um = set->grid().toWorld(set->bounds().hi);
  return f;
}

inline void expectFigures(const std::string& set, std::uint64_t cells, std::uint64_t segments, double length_um,
                          const std::array<double, 3>& lo_um, const std::array<double, 3>& hi_um) {
  const Figures f = figuresOfSet(set);
  EXPECT_EQ(f.cells, cells);
  EXPECT_EQ(f.segments, segments);
  EXPECT_NEAR(f.length_um / length_um, 1, 1e-6);
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::size_t>(axis);
    constexpr double kRounding_um = 0x1p-11;  // half a quantum of the finest grid
    const double most_um = 1e-6 * std::max(std::abs(lo_um[at]), std::abs(hi_um[at])) + kRounding_um;
    EXPECT_NEAR(f.lo_um[axis], lo_um[at], most_um);
    EXPECT_NEAR(f.hi_um[axis], hi_um[at], most_um);
  }
}

inline void expectFigures(const std::string& set, const nlohmann::json& f) {
  expectFigures(set, f["cells"], f["segments"], f["length_um"], f["lo"], f["hi"]);
}

// The finest grid: rounding must stay below the tolerance.
inline Outcome ingestFine(std::vector<std::string> arguments, const std::string& set) {
  arguments.insert(arguments.begin(), "ingest");
  for (const char* const more : {"-o", set.c_str(), "--no-soma-links", "--no-levels", "--quantum", "2^-10"})
    arguments.emplace_back(more);
  return runFiliform(arguments);
}

}  // namespace filiform::test
