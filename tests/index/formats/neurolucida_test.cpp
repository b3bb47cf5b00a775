#include "index/formats/internal/neurolucida.h"

#include "index/formats/internal/graph_file.h"
#include "index/input/input.h"
#include "tests/support/corpus.h"
#include "tests/support/graph_reading.h"
#include "tests/support/temp_folder.h"

#include <array>
#include <cmath>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::GraphReading;
using test::readingRow;

GraphReading readAsc(const std::string& text, bool soma_links = true) {
  GraphOptions options;
  options.units.soma_links = soma_links;
  return test::readAs(GraphFormat::kNeurolucida, text, options);
}

double lengthFrom(const Cell& cell) {
  double length = 0;
  for (std::uint32_t s = 0; s < cell.segmentRanks(); ++s) {
    const auto [child, parent] = cell.ends(s);
    length += (cell.positions_um[child] - cell.positions_um[parent]).norm();
  }
  return length;
}

const std::string kSoma = "(\"CellBody\" (Color Red) (CellBody) (3 0 0 0) (0 3 0 0) (-3 0 0 0) (0 -3 0 0))\n";
const std::string kTree =
    "; a comment (with a parenthesis\n"
    "( (Color RGB (128, 64, 0)) (Dendrite)\n"
    "  (0 3 0 2) (0 9 0 1.5) ; root\n"
    "  <(0 9.5 0 0.2)>\n"
    "  (Dot (Color White) (Name \"Marker (1\") (5 5 5 0.1))\n"
    "  ( (0 9 0 1) (4 12 0 1 S3) Normal\n"
    "  | (-4 12 0 1) ( (-5 14 0 1) High | (-3 14 0 1) ) ; two more\n"
    "  ) ; End of split\n"
    ")\n";

TEST(Neurolucida, ReadsASomaAndNestedBranches) {
  const GraphReading reading = readAsc(kSoma + kTree);
  EXPECT_EQ(readingRow(reading), "warn 7 6 0 0 REPEATED_POINT:1 SOMA_CONTOUR:1 SOMA_LINK:1 W_ELEMENT:2");
  const Cell& cell = reading.cell;
  EXPECT_EQ(cell.sample_ids, (std::vector<std::int64_t>{1, 5, 6, 7, 8, 9, 10}));
  EXPECT_EQ(cell.positions_um[0], Vector3d(0, 0, 0));
  EXPECT_FLOAT_EQ(cell.radii_um[0], 3);  // of the contour
  EXPECT_EQ(cell.types, (std::vector<std::uint16_t>{1, 3, 3, 3, 3, 3, 3}));
  EXPECT_FLOAT_EQ(cell.radii_um[1], 1);  // half the diameter
  EXPECT_FLOAT_EQ(cell.radii_um[2], 0.75);
  EXPECT_EQ(cell.parents, (std::vector<std::uint32_t>{kNoParent, 0, 1, 2, 2, 4, 4}));
}

TEST(Neurolucida, SomaLinksCanBeLeftOut) {
  const GraphReading reading = readAsc(kSoma + kTree, false);
  EXPECT_EQ(readingRow(reading), "warn 7 5 0 0 REPEATED_POINT:1 SOMA_CONTOUR:1 W_ELEMENT:2");
  EXPECT_EQ(reading.report.roots, 2u);
}

TEST(Neurolucida, AStackOfContoursIsOneSomaAndEachTreeJoinsItsOwn) {
  const auto contour = [](double x, double z) {
    std::ostringstream out;
    out << "((CellBody) (" << x + 5 << " 0 " << z << " 0) (" << x - 5 << " 0 " << z << " 0) (" << x << " 5 " << z
        << " 0) (" << x << " -5 " << z << " 0))\n";
    return out.str();
  };
  const GraphReading reading = readAsc(contour(0, -2) + contour(0, 2) + contour(100, 0) +
                                       "((Axon) (90 0 0 1) (50 0 0 1))" + "((Apical) (0 8 0 1) (0 20 0 1))");
  EXPECT_EQ(reading.report.samples, 6u);
  EXPECT_EQ(reading.report.codes[InputCode::SOMA_LINK], 2u);
  EXPECT_EQ(reading.cell.parents, (std::vector<std::uint32_t>{kNoParent, kNoParent, 1, 2, 0, 4}));
  EXPECT_EQ(reading.cell.types, (std::vector<std::uint16_t>{1, 1, 2, 2, 4, 4}));
}

TEST(Neurolucida, WhatIsNoTreeIsLeftOutAndCounted) {
  EXPECT_EQ(
      readingRow(readAsc("(\"Pia\" (Closed) (0 0 0 1) (9 9 9 1))\n(Dot (1 2 3 4))\n((Axon) (0 0 0 1) (1 0 0 1))")),
      "warn 2 1 0 0 W_ELEMENT:2");
  EXPECT_EQ(readingRow(readAsc("((Color Red) (0 0 0 1) (1 0 0 1))")), "warn 2 1 0 0 W_BAD_TYPE:1");
}

TEST(Neurolucida, ATextIsNoNeurite) {
  for (const char* label :
       {"(\"see note 3\" (Color White) (-140 -150 80))\n", "((Color White) (-140 -150 80) \"see\")\n",
        "((Color White) (-140 -150 80 1) (Font \"Arial\" 12) \"see\")\n", "((-140 -150 80))\n"})
    EXPECT_EQ(readingRow(readAsc(kSoma + "((Dendrite) (0 3 0 1) (0 9 0 1))\n" + label)),
              "warn 3 2 0 0 SOMA_CONTOUR:1 SOMA_LINK:1 W_ELEMENT:1")
        << label;
}

TEST(Neurolucida, AContourNamedSomaIsOne) {
  const std::string tree = "((Dendrite) (0 6 0 1) (0 9 0 1))\n";
  for (const char* name : {"Soma", "soma 2", "Cell Body", "CELLBODY"})
    EXPECT_EQ(readingRow(readAsc("(\"" + std::string(name) + "\" (Closed) (MBFObjectType 5) (5 0 0) (0 5 0) (-5 0 0))" +
                                 tree)),
              "accept 3 2 0 0 SOMA_CONTOUR:1 SOMA_LINK:1")
        << name;
  for (const char* other : {"(\"Somatosensory\" (Closed) (5 0 0) (0 5 0) (-5 0 0))", "(\"Soma\" (5 0 0))"})
    EXPECT_EQ(readingRow(readAsc(other + tree)), "warn 2 1 0 0 W_ELEMENT:1") << other;
  EXPECT_EQ(readAsc("((axon) (0 6 0 1) (0 9 0 1))").cell.types, (std::vector<std::uint16_t>{2, 2}));
}

TEST(Neurolucida, ATreeThatBeginsOnAnotherIsJoinedThere) {
  const std::string dendrite = "((Dendrite) (0 6 0 2) (0 20 0 2) (0 40 0 2) (0 60 0 1))\n";
  const std::string axon = "((Axon) (0 40 0 1) (10 40 0 1) (20 40 0 1))\n";
  for (const std::string& text : {kSoma + dendrite + axon, axon + kSoma + dendrite}) {
    const GraphReading reading = readAsc(text);
    EXPECT_EQ(readingRow(reading), "accept 7 6 0 0 REPEATED_POINT:1 SOMA_CONTOUR:1 SOMA_LINK:1");
    EXPECT_NEAR(lengthFrom(reading.cell), 6 + 54 + 20, 1e-9);
  }
  // Trees that begin on each other, and a tree that meets its own beginning: no ring.
  EXPECT_EQ(readingRow(readAsc("((Axon) (0 0 0 1) (9 0 0 1))((Axon) (9 0 0 1) (0 0 0 1))")),
            "accept 3 2 0 0 REPEATED_POINT:1");
  EXPECT_EQ(readingRow(readAsc("((Axon) (0 0 0 1) (9 0 0 1) (0 0 0 1))")), "accept 3 2 0 0");
  // Trees that begin at one place stay what they are.
  EXPECT_EQ(readingRow(readAsc(kSoma + "((Axon) (0 6 0 1) (9 0 0 1))((Dendrite) (0 6 0 1) (0 9 0 1))")),
            "accept 5 4 0 0 SOMA_CONTOUR:1 SOMA_LINK:2");
}

TEST(Neurolucida, BadPointsAreDroppedWithARecord) {
  EXPECT_EQ(readingRow(readAsc("((Axon) (0 0 0 1) (1 oops 0 1) (2 0 0 1) (3 0) (4 0 0 -1) (5 0 0))")),
            "warn 4 1 2 2 W_BAD_LINE:1 W_BAD_RADIUS:1 W_MISSING_PARENT:2 W_SHORT_LINE:1");
}

TEST(Neurolucida, APointOutOfRangeTakesItsLinkAlong) {
  EXPECT_EQ(readingRow(readAsc("((Axon) (0 0 0 1) (1e30 0 0 1) (2 0 0 1))")),
            "warn 2 0 1 1 W_MISSING_PARENT:1 W_RANGE:1");
  EXPECT_EQ(readingRow(readAsc(kSoma + "((Axon) (1e30 0 0 1) (2 0 0 1))")),
            "warn 2 0 1 1 SOMA_CONTOUR:1 W_MISSING_PARENT:1 W_RANGE:1");
  EXPECT_EQ(readingRow(readAsc("((CellBody) (1e30 0 0 1))((Axon) (0 0 0 1) (2 0 0 1))")),
            "warn 2 1 1 0 SOMA_CONTOUR:1 W_RANGE:1");
}

std::string reasonOf(const std::string& text) {
  const GraphReading reading = readAsc(text);
  EXPECT_EQ(reading.report.severity, Severity::kRefuse) << text;
  return refusalReason(reading.report);
}

TEST(Neurolucida, MistakesNameTheirLine) {
  EXPECT_EQ(reasonOf("((Axon)\n (0 0 0 1)\n"), "line 1: this '(' is never closed");
  EXPECT_EQ(reasonOf("((Axon)\n (0 0 0 1)))\n"), "line 2: this ')' closes nothing");
  EXPECT_EQ(reasonOf("((Axon)\n (0 0 0 1\n (1 0 0 1))\n"), "line 2: this point has no ')'");
  EXPECT_EQ(reasonOf("((Axon) (0 0 0 1) | (1 0 0 1))"), "line 1: '|' outside of branches");
  EXPECT_EQ(reasonOf("ncols 100\nnrows 100\n"), "line 1: not Neurolucida: '(' must come first");
  EXPECT_EQ(reasonOf("1 1 0 0 0 5 -1\n"), "line 1: not Neurolucida: '(' must come first");
  EXPECT_EQ(readAsc("").report.severity, Severity::kRefuse);
}

TEST(Neurolucida, DeepNestingNeedsNoStack) {
  std::string text = "((Axon) (0 0 0 1)";
  constexpr int kDepth = 200000;
  for (int i = 1; i <= kDepth; ++i) text += "((" + std::to_string(i) + " 0 0 1)";
  text += std::string(kDepth + 1, ')');
  const GraphReading reading = readAsc(text);
  EXPECT_EQ(reading.report.samples, std::uint64_t{kDepth} + 1);
  EXPECT_EQ(readAsc(std::string(1000000, '(')).report.severity, Severity::kRefuse);
}

TEST(Neurolucida, FoldersAndArchivesHoldAscToo) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("one.asc"), kSoma + kTree);
  test::writeBytes(folder.file("two.ASC"), kTree);
  Input input({folder.path()});
  std::vector<std::string> sources;
  for (Cell cell; input.next(cell);) sources.push_back(cell.source);
  EXPECT_EQ(sources, (std::vector<std::string>{"one.asc", "two.ASC"}));
  EXPECT_EQ(cellNames(sources), (std::vector<std::string>{"one", "two"}));
}

// One cell in two formats, from MorphIO: the same tree, to the digits that were written.
TEST(Neurolucida, ACellInAscIsThatInSwc) {
  if (!test::corpusFolder()) GTEST_SKIP() << "FILIFORM_CORPUS is not set";
  const auto folder = *test::corpusFolder() / "circuits" / "obi-one" / "morphologies";
  const auto cellOf = [&](const char* file, bool soma_links) {
    InputOptions options;
    options.swc.soma_links = soma_links;
    Input input({(folder / file).string()}, options);
    Cell cell;
    EXPECT_TRUE(input.next(cell)) << file;
    return cell;
  };
  const Cell swc = cellOf("C060114A5.swc", true), asc = cellOf("C060114A5.asc", true);
  const Cell free = cellOf("C060114A5.asc", false);
  // Without the soma: links between samples that are not of type 1.
  const auto neurites = [](const Cell& cell) {
    double length = 0;
    for (std::size_t i = 0; i < cell.samples(); ++i)
      if (cell.parents[i] != kNoParent && cell.types[i] != 1 && cell.types[cell.parents[i]] != 1)
        length += (cell.positions_um[i] - cell.positions_um[cell.parents[i]]).norm();
    return length;
  };
  EXPECT_NEAR(neurites(asc), 21728.719846, 1e-4);  // an independent reading of the SWC file
  EXPECT_NEAR(neurites(asc), neurites(swc), 1e-4);
  EXPECT_NEAR(lengthFrom(free), neurites(swc), 1e-4);
  // The same places: the SWC file repeats those at which branches begin.
  const auto places = [](const Cell& cell) {
    std::set<std::array<double, 3>> found;
    for (std::size_t i = 0; i < cell.samples(); ++i)
      if (cell.types[i] != 1)
        found.insert({cell.positions_um[i].x(), cell.positions_um[i].y(), cell.positions_um[i].z()});
    return found;
  };
  EXPECT_EQ(places(asc), places(swc));
  std::size_t roots = 0;
  for (std::size_t i = 0; i < asc.samples(); ++i) roots += asc.parents[i] == 0;
  EXPECT_EQ(roots, 11u);  // root sections, joined to the soma
}

}  // namespace
}  // namespace filiform
