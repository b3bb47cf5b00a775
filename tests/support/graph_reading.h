// What readGraph() makes of a text, and its report as a line.
#pragma once

#include "index/formats/internal/graph_file.h"

#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace filiform::test {

struct GraphReading {
  Cell cell;
  InputReport report;
};

inline GraphReading readAs(GraphFormat format, const std::string& bytes, const GraphOptions& options = {}) {
  GraphReading reading;
  reading.report = readGraph(bytes, "test", format, options, reading.cell);
  return reading;
}

// "severity samples segments dropped cut codes"; also checks that the cell's arrays have equal lengths.
inline std::string readingRow(const GraphReading& reading) {
  const InputReport& r = reading.report;
  const Cell& cell = reading.cell;
  const std::size_t n = cell.samples();
  EXPECT_EQ(cell.positions_um.size(), n);
  EXPECT_EQ(cell.radii_um.size(), n);
  EXPECT_EQ(cell.types.size(), n);
  EXPECT_EQ(cell.parents.size(), cell.isGraph() ? 0 : n);
  EXPECT_EQ(r.samples, n);
  EXPECT_TRUE(r.severity != Severity::kRefuse || n == 0);
  std::uint64_t segments = 0;
  for (std::uint32_t s = 0; s < cell.segmentRanks(); ++s) segments += cell.ends(s)[0] != cell.ends(s)[1];
  EXPECT_EQ(r.segments, segments);
  std::ostringstream out;
  out << name(r.severity) << ' ' << r.samples << ' ' << r.segments << ' ' << r.dropped_lines << ' ' << r.links_cut;
  for (const auto& [code, count] : r.codes.all()) out << ' ' << name(code) << ':' << count;
  return out.str();
}

}  // namespace filiform::test
