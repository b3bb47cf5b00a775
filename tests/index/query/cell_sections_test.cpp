// Sections, against what Import3d of NEURON 8.2 makes of the same files (h.Import3d_SWC_read, then instantiate): the
// numbers are positions in h.allsec(), the places arc3d / L.
#include "index/query/cell_sections.h"

#include "index/errors.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::storeOf;

Cell cellFrom(const std::string& swc) {
  Cell cell;
  cell.source = "cell.swc";
  std::istringstream in(swc);
  std::map<std::int64_t, std::uint32_t> rank_of;
  std::int64_t id = 0, parent = 0;
  for (double type = 0, x = 0, y = 0, z = 0, radius = 0; in >> id >> type >> x >> y >> z >> radius >> parent;) {
    rank_of[id] = static_cast<std::uint32_t>(cell.samples());
    cell.sample_ids.push_back(id);
    cell.types.push_back(static_cast<std::uint16_t>(type));
    cell.positions_um.emplace_back(x, y, z);
    cell.radii_um.push_back(static_cast<float>(radius));
    cell.parents.push_back(parent < 0 ? kNoParent : rank_of.at(parent));
  }
  return cell;
}

CellPaths pathsWithTypes(const Cell& cell) { return CellPaths(readCell(*storeOf({cell}, 7), 0, true)); }

// "section:pos" of each sample, in the order of the file.
std::string sectionPlaces(const std::string& swc) {
  const CellPaths cell = pathsWithTypes(cellFrom(swc));
  const CellSections sections(cell);
  std::ostringstream out;
  out.precision(6);
  for (std::uint32_t rank = 0; rank < cell.samples(); ++rank) {
    const auto [section, pos] = sections.of(cell.at(rank));
    out << (rank > 0 ? " " : "") << section << ':' << pos;
  }
  return out.str();
}

TEST(CellSections, AreNumberedByTypeAndThenInTheOrderOfTheFile) {
  EXPECT_EQ(sectionPlaces("1 1 0 0 0 5 -1 2 3 0 6 0 1 1 3 3 0 16 0 1 2 4 3 5 16 0 1 3 5 3 -5 16 0 1 3 6 3 -15 16 0 1 5 "
                          "7 2 0 -6 0 1 1 8 2 0 -26 0 1 7 9 4 6 0 0 1 1 10 4 10 0 0 1 9"),
            "0:0.5 2:0 2:1 3:1 4:0.333333 4:1 1:0 1:1 5:0 5:1");
  EXPECT_EQ(sectionPlaces("1 1 0 0 0 5 -1 2 3 0 6 0 1 1 3 3 0 16 0 1 2 4 4 0 26 0 1 3 5 4 0 31 0 1 4 6 2 9 0 0 1 1"),
            "0:0.5 2:0 2:1 3:0.666667 3:1 1:1")
      << "a section ends where the type changes";
}

TEST(CellSections, ASomaIsABallAContourOrForked) {
  EXPECT_EQ(sectionPlaces("1 1 0 0 0 5 -1 2 1 0 -5 0 5 1 3 1 0 5 0 5 1 4 3 0 6 0 1 1 5 3 0 10 0 1 4 6 2 0 -8 0 1 1 "
                          "7 2 0 -12 0 1 6"),
            "0:0.5 0:0.5 0:0.5 2:0 2:1 1:0 1:1")
      << "three samples of NeuroMorpho.Org are a sphere";
  EXPECT_EQ(sectionPlaces("1 1 0 0 0 5 -1 2 1 4 0 0 5 1 3 1 8 0 0 5 2 4 1 12 0 0 5 3 5 3 4 10 0 1 2 6 3 4 20 0 1 5 "
                          "7 3 12 6 0 1 4 8 3 12 8 0 1 7 9 2 0 -5 0 1 1 10 2 0 -10 0 1 9"),
            "0:0 0:0.333333 0:0.666667 0:1 2:0 2:1 3:0.75 3:1 1:0.5 1:1");
  EXPECT_EQ(sectionPlaces("1 1 0 0 0 5 -1 2 1 5 0 0 5 1 3 1 9 0 0 5 2 4 1 5 4 0 5 2 5 3 5 -9 0 1 2 6 3 5 -19 0 1 5 "
                          "7 3 9 5 0 1 3 8 3 9 9 0 1 7"),
            "0:0 0:1 1:1 2:1 3:0 3:1 4:0.555556 4:1");
}

TEST(CellSections, BranchesAtABeginningAndSectionsWithoutLengthAreAsInNeuron) {
  EXPECT_EQ(sectionPlaces("1 3 0 0 0 1 -1 2 3 10 0 0 1 1 3 3 20 0 0 1 2 4 3 0 10 0 1 1 5 3 0 30 0 1 4"),
            "0:0 0:0.5 0:1 1:0.333333 1:1");
  EXPECT_EQ(sectionPlaces("1 1 0 0 0 5 -1 2 3 0 6 0 1 1 3 3 0 16 0 1 2 4 3 3 6 0 1 1 5 3 3 10 0 1 4 6 3 9 6 0 1 4 "
                          "7 3 12 6 0 1 6"),
            "0:0.5 1:0 1:1 2:0 2:1 3:0.666667 3:1");
  EXPECT_EQ(sectionPlaces("1 1 0 0 0 5 -1 2 3 0 6 0 1 1 3 3 0 10 0 1 2 4 3 0 10 0 1 3 5 3 5 10 0 1 4 6 3 -5 10 0 1 4 "
                          "7 3 1 10 0 1 3 8 3 9 10 0 1 7"),
            "0:0.5 1:0 1:1 1:1 2:1 3:1 4:0.111111 4:1")
      << "sample 4 is left out: it lies where its parent's section ends";
}

TEST(CellSections, APlaceOnASegmentIsTheSameThereAndBack) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    Cell cell = test::randomColumn(seed, 1, 200, 150).front();
    std::mt19937_64 random(seed);
    for (std::uint16_t& type : cell.types) type = static_cast<std::uint16_t>(1 + random() % 4);
    const CellPaths paths = pathsWithTypes(cell);
    if (paths.graph().isGraph()) continue;
    const CellSections sections(paths);
    for (std::uint32_t number = 0; number < sections.size(); ++number)
      for (const double pos : {0.0, 0.125, 0.5, 0.9, 1.0}) {
        const auto place = sections.at(number, pos);
        ASSERT_TRUE(place);
        const auto [section, at] = sections.of(*place);
        if (pos > 0 && pos < 1 && place->t > 0) {
          EXPECT_EQ(section, number);
          if (at != 0.5) {  // a soma of one sample has pos 0.5
            EXPECT_NEAR(at, pos, 1e-9);
          }
        }
      }
    EXPECT_FALSE(sections.at(sections.size(), 0.5));
    for (std::uint32_t rank = 0; rank < paths.samples(); ++rank) {
      const auto [section, pos] = sections.of(paths.at(rank));
      EXPECT_LT(section, sections.size());
      EXPECT_TRUE(pos >= 0 && pos <= 1) << pos;
    }
  }
}

TEST(CellSections, SeveralTreesAndOddOrdersStayInBounds) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 200; ++round) {
    Cell cell;
    cell.source = "odd.swc";
    const auto n = static_cast<std::uint32_t>(1 + random() % 12);
    for (std::uint32_t i = 0; i < n; ++i) {
      cell.sample_ids.push_back(static_cast<std::int64_t>((i * 7 + 3) % 13));
      cell.types.push_back(static_cast<std::uint16_t>(random() % 4));
      cell.positions_um.emplace_back(static_cast<double>(random() % 3), static_cast<double>(random() % 3), 0);
      cell.radii_um.push_back(random() % 4 == 0 ? kUnknownRadius : 1.0f);
      cell.parents.push_back(i == 0 || random() % 4 == 0 ? kNoParent : static_cast<std::uint32_t>(random() % i));
    }
    const CellPaths paths = pathsWithTypes(cell);
    const CellSections sections(paths);
    for (std::uint32_t rank = 0; rank < paths.samples(); ++rank)
      EXPECT_LT(sections.of(paths.at(rank)).section, sections.size());
    for (std::uint32_t number = 0; number < sections.size(); ++number) EXPECT_TRUE(sections.at(number, 0.3));
  }
}

}  // namespace
}  // namespace filiform
