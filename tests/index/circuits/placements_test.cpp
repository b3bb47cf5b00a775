#include "index/circuits/placements.h"

#include "index/errors.h"
#include "tests/support/temp_folder.h"
#include "tests/support/what_of.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <random>
#include <sstream>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;

const std::string kHeader = "source\tx_um\ty_um\tz_um\tqw\tqx\tqy\tqz\tname\n";
const std::string kBent = "1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n7 3 2 6 0.5 1 2\n8 2 -4 0 0 nan 1\n";

std::string refusal(const std::string& text) {
  return test::whatOf<InputError>([&] { PlacementTable::parse(text, "t.tsv"); });
}

struct Library {
  test::TempFolder folder;
  Library() {
    put("a.swc", kBent);
    put("L4/b.swc", "1 1 10 0 0 5 -1\n2 3 20 0 0 1 1\n");
  }
  void put(const std::string& name, const std::string& bytes) const {
    fs::create_directories(fs::path(folder.file(name)).parent_path());
    test::writeBytes(folder.file(name), bytes);
  }
};

std::vector<Cell> placed(PlacedCells& cells) {
  std::vector<Cell> all;
  for (Cell cell; cells.next(cell);) all.push_back(cell);
  return all;
}

std::vector<Cell> placed(const Library& library, const std::string& rows) {
  Input input({library.folder.path()});
  PlacedCells cells(input, PlacementTable::parse(kHeader + rows, "t.tsv"));
  return placed(cells);
}

TEST(PlacementTable, TakesMarksLineEndsBlankLinesAndAMissingLastTab) {
  const PlacementTable table = PlacementTable::parse(
      "\xEF\xBB\xBFsource\tx_um\ty_um\tz_um\tqw\tqx\tqy\tqz\tname\r\n\r\na b.swc\t1\t-2.5e1\t+3\t1\t0\t0\t-0\tx y\r\n"
      "\nz/c.swc\t0\t0\t0\t0\t0\t0.6\t0.8",
      "t.tsv");
  ASSERT_EQ(table.rows().size(), 2u);
  EXPECT_EQ(table.sources(), (std::vector<std::string>{"a b.swc", "z/c.swc"}));
  EXPECT_EQ(table.rows()[0].moved_um, (std::array<double, 3>{1, -25, 3}));
  EXPECT_EQ(table.name(table.rows()[0]), "x y");
  EXPECT_EQ(table.rows()[0].line, 3u);
  EXPECT_EQ(table.name(table.rows()[1]), "");
  EXPECT_EQ(table.rows()[1].line, 5u);
}

TEST(PlacementTable, RefusesWhatIsWrongAndNamesTheLine) {
  const auto row = [](const std::string& text) { return refusal(kHeader + "a\t0\t0\t0\t1\t0\t0\t0\t\n" + text); };
  EXPECT_EQ(refusal(""),
            "t.tsv:1: expected the header line `source x_um y_um z_um qw qx qy qz name`, separated by tabs");
  EXPECT_NE(refusal("a\t0\t0\t0\t1\t0\t0\t0\t\n").find("t.tsv:1: expected the header"), std::string::npos);
  EXPECT_EQ(row("a\t0\t0\t0\t1\t0\t0"), "t.tsv:3: has 7 columns instead of 9, separated by tabs");
  EXPECT_EQ(row("a\t0\t0\t0\t1\t0\t0\t0\tn\tm"), "t.tsv:3: has 10 columns instead of 9, separated by tabs");
  EXPECT_EQ(row("a 0 0 0 1 0 0 0"), "t.tsv:3: has 1 column instead of 9, separated by tabs");
  EXPECT_EQ(row("\t0\t0\t0\t1\t0\t0\t0\t"), "t.tsv:3: the source is empty");
  for (const char* bad : {"nan", "inf", "1e999", "", "1,5", "0x1p3", "1 2", "\x1b[2J"})
    EXPECT_NE(row(std::string("a\t0\t") + bad + "\t0\t1\t0\t0\t0\t").find("t.tsv:3: y_um is '"), std::string::npos);
  EXPECT_NE(row("a\t0\t0\t0\t1\t0\tx\t0\t").find("qy is 'x'"), std::string::npos);
  EXPECT_EQ(row("a\t0\t0\t0\t0\t0\t0\t0\t"), "t.tsv:3: the quaternion qw qx qy qz has length 0.000000, not 1");
  EXPECT_NE(row("a\t0\t0\t0\t1e200\t1e200\t0\t0\t").find("not 1"), std::string::npos);
  EXPECT_NE(row("a\t0\t0\t0\t1\t0.1\t0\t0\t").find("not 1"), std::string::npos);
  EXPECT_NE(row(std::string(70000, 'x')).find("t.tsv:3: the line is longer"), std::string::npos);
}

TEST(PlacementTable, ReadsAFileAsItParsesText) {
  const test::TempFolder folder;
  for (const std::string& text :
       {kHeader + "a\t1\t2\t3\t0\t1\t0\t0\tn\nb\t1\t2\t3\t0\t1\t0\t0\tm", kHeader + std::string(70000, 'x') + "\n",
        kHeader, std::string(), std::string("\n\n"), kHeader + "a\t0"}) {
    test::writeBytes(folder.file("t.tsv"), text);
    EXPECT_EQ(test::whatOf<InputError>([&] { PlacementTable::read(folder.file("t.tsv")); }), refusal(text));
    if (refusal(text) != "no InputError") continue;
    const PlacementTable a = PlacementTable::read(folder.file("t.tsv")), b = PlacementTable::parse(text, "t.tsv");
    EXPECT_EQ(a.digest(), b.digest());
    EXPECT_EQ(a.bytes(), b.bytes());
    EXPECT_EQ(a.sources(), b.sources());
  }
  EXPECT_THROW(PlacementTable::read(folder.file("absent.tsv")), IoError);
}

TEST(PlacementTable, NormalisesAQuaternionOfRoundedNumbers) {
  const PlacementTable table = PlacementTable::parse(kHeader + "a\t0\t0\t0\t0.7071\t0\t0.7071\t0\t", "t.tsv");
  EXPECT_DOUBLE_EQ(table.rows()[0].turned[0], std::sqrt(0.5));
}

TEST(PlacedCells, TurnAndMoveAndKeepAllElse) {
  const Library library;
  const std::string row = "a.swc\t100\t200\t300\t0.70710678118654752\t0\t0\t0.70710678118654752\tturned\n";
  const std::vector<Cell> cells = placed(library, row);
  ASSERT_EQ(cells.size(), 1u);
  const Cell& cell = cells[0];
  EXPECT_EQ(cell.source, "a.swc");
  EXPECT_EQ(cell.name, "turned");
  EXPECT_EQ(cell.sample_ids, (std::vector<std::int64_t>{1, 2, 7, 8}));
  EXPECT_EQ(cell.parents, (std::vector<std::uint32_t>{kNoParent, 0, 1, 0}));
  EXPECT_EQ(cell.types, (std::vector<std::uint16_t>{1, 3, 3, 2}));
  EXPECT_EQ(cell.radii_um[0], 5);
  EXPECT_TRUE(std::isnan(cell.radii_um[3]));
  // A quarter turn about z: (x, y, z) -> (-y, x, z).
  const std::vector<Vector3d> wanted = {{100, 200, 300}, {94, 200, 300}, {94, 202, 300.5}, {100, 196, 300}};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_LT((cell.positions_um[i] - wanted[i]).norm(), 1e-12);
}

TEST(PlacedCells, TurnAsTheFormulaOfQuaternionsSays) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const Library library;
  for (int round = 0; round < 50; ++round) {
    Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
    q.normalize();
    const Vector3d t(1e3 * normal(random), 1e3 * normal(random), 1e3 * normal(random));
    std::ostringstream row;
    row.precision(17);
    row << "a.swc\t" << t.x() << '\t' << t.y() << '\t' << t.z() << '\t' << q.w() << '\t' << q.x() << '\t' << q.y()
        << '\t' << q.z() << "\t\n";
    const std::vector<Cell> cells = placed(library, row.str());
    const Eigen::Quaterniond p = q * Eigen::Quaterniond(0, 2, 6, 0.5) * q.conjugate();
    EXPECT_LT((cells.at(0).positions_um[2] - (p.vec() + t)).norm(), 1e-11);
  }
}

TEST(PlacedCells, ComeInTheOrderOfIdsWhateverTheOrderOfRows) {
  const Library library;
  std::vector<std::string> rows;
  for (int i = 0; i < 40; ++i)
    rows.push_back((i % 3 == 0 ? "a.swc\t" : "L4/b.swc\t") + std::to_string(i / 2) + "\t0\t0\t1\t0\t0\t0\t" +
                   (i % 5 == 0 ? "named" : "") + "\n");
  std::vector<std::string> first;
  std::uint64_t first_digest = 0;
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    std::shuffle(rows.begin(), rows.end(), std::mt19937(seed));
    std::string text;
    for (const std::string& row : rows) text += row;
    const PlacementTable table = PlacementTable::parse(kHeader + text, "t.tsv");
    std::vector<std::string> all;
    std::pair<std::string, std::uint64_t> before;
    for (const Cell& cell : placed(library, text)) {
      const std::pair<std::string, std::uint64_t> now(cell.source, cell.digest);
      EXPECT_LE(before, now);
      before = now;
      std::ostringstream shown;
      shown << cell.source << ' ' << cell.digest << ' ' << cell.name << ' ' << cell.positions_um[0].transpose();
      all.push_back(shown.str());
    }
    EXPECT_EQ(all.size(), 40u);
    if (seed == 0) first = all, first_digest = table.digest();
    EXPECT_EQ(all, first);
    EXPECT_EQ(table.digest(), first_digest);
  }
}

TEST(PlacedCells, PlaceOnlyWhatTheTableSays) {
  const Library library;
  EXPECT_TRUE(placed(library, "").empty());
  Input input({library.folder.path()});
  PlacedCells cells(input, PlacementTable::parse(kHeader + "L4/b.swc\t0\t0\t0\t1\t0\t0\t0\t\n", "t.tsv"));
  for (int pass = 0; pass < 2; ++pass) {
    EXPECT_EQ(placed(cells).size(), 1u);
    EXPECT_EQ(cells.report().morphologies, 1u);
    EXPECT_EQ(cells.report().samples, 2u);
    EXPECT_EQ(cells.report().segments, 1u);
    EXPECT_TRUE(cells.report().codes.empty());
    cells.rewind();
  }
}

TEST(PlacedCells, RefuseASourceThatIsNotInTheInputOrTwice) {
  const Library library;
  library.put("other/a.swc", kBent);
  Input folder({library.folder.path()});
  const PlacementTable table =
      PlacementTable::parse(kHeader + "a.swc\t0\t0\t0\t1\t0\t0\t0\t\nb.swc\t0\t0\t0\t1\t0\t0\t0\t\n", "t.tsv");
  EXPECT_EQ(test::whatOf<InputError>([&] { PlacedCells(folder, table); }),
            "t.tsv:3: 'b.swc' is not a source of the input; one source is 'L4/b.swc'");
  Input files({library.folder.file("a.swc"), library.folder.file("other/a.swc"), library.folder.file("L4/b.swc")});
  EXPECT_EQ(test::whatOf<InputError>([&] { PlacedCells(files, table); }),
            "t.tsv:2: 'a.swc' is the source of more than one input: name their folder instead of the files");
}

TEST(PlacedCells, RowsOfARefusedMorphologyAreNamed) {
  const Library library;
  library.put("empty.swc", "# nothing\n");
  Input input({library.folder.path()});
  PlacedCells cells(input, PlacementTable::parse(
                               kHeader + "empty.swc\t0\t0\t0\t1\t0\t0\t0\t\na.swc\t0\t0\t0\t1\t0\t0\t0\t\n", "t.tsv"));
  EXPECT_EQ(placed(cells).size(), 1u);
  ASSERT_EQ(cells.report().records.size(), 1u);
  EXPECT_EQ(cells.report().records[0].line, 2u);
  EXPECT_EQ(cells.report().records[0].token, "empty.swc");
  EXPECT_EQ(cells.report().placed, 1u);
}

TEST(PlacedCells, DropWhatLiesBeyondTheGridAndSaySo) {
  const Library library;  // a.swc: x 0, 0, 2, -4
  const std::string far = "a.swc\t1073741823\t0\t0\t1\t0\t0\t0\t\n", gone = "a.swc\t0\t0\t4e300\t1\t0\t0\t0\t\n";
  Input input({library.folder.path()});
  PlacedCells cells(input, PlacementTable::parse(kHeader + far + gone, "t.tsv"));
  const std::vector<Cell> all = placed(cells);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].sample_ids, (std::vector<std::int64_t>{1, 2, 8}));
  EXPECT_EQ(all[0].parents, (std::vector<std::uint32_t>{kNoParent, 0, 0}));
  EXPECT_EQ(all[0].types, (std::vector<std::uint16_t>{1, 3, 2}));
  const PlacementReport& report = cells.report();
  EXPECT_EQ(report.codes[InputCode::W_RANGE], 5u);
  EXPECT_EQ(report.codes[InputCode::W_MISSING_PARENT], 1u);
  EXPECT_EQ(report.dropped_samples, 5u);
  EXPECT_EQ(report.cut_links, 1u);
  EXPECT_EQ(report.samples + report.dropped_samples, 8u);
  EXPECT_EQ(report.placed, 1u);
  EXPECT_EQ(report.records.front().line, 2u);
  EXPECT_EQ(report.records[report.records.size() - 1].line, 3u);
}

TEST(PlacedCells, KeepIdBlocksApartWhereTheirFirstSampleIsDropped) {
  const Library library;
  library.put("blocks.swc", "1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n1 1 9 0 0 5 -1\n2 3 8 6 0 1 1\n3 3 7 6 0 1 2\n");
  const std::vector<Cell> all = placed(library, "blocks.swc\t1073741816\t0\t0\t1\t0\t0\t0\t\n");
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].sample_ids, (std::vector<std::int64_t>{1, 2, 2, 3}));
  EXPECT_EQ(all[0].block_starts, std::vector<std::uint32_t>{2});
  EXPECT_EQ(all[0].parents, (std::vector<std::uint32_t>{kNoParent, 0, kNoParent, 2}));
}

TEST(PlacementTable, NeverFailsInAnyOtherWayHoweverItIsDamaged) {
  const std::string good = kHeader + "a.swc\t100\t-2.5\t300\t0.6\t0\t0.8\t0\tname\nL4/b.swc\t1\t2\t3\t1\t0\t0\t0\t\n";
  std::mt19937 random(11);
  for (int round = 0; round < 3000; ++round) {
    std::string text = good;
    for (std::uint32_t k = 0, n = 1 + random() % 4; k < n; ++k) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.erase(at, 1 + random() % 5);
          break;
        case 2:
          text.insert(at, 1, "\t\n0.-eE\r"[random() % 8]);
          break;
        default:
          text.resize(at + 1);
      }
      if (text.empty()) text = "x";
    }
    try {
      const PlacementTable table = PlacementTable::parse(text, "t.tsv");
      for (const PlacementTable::Row& row : table.rows()) {
        double square = 0;
        for (const double component : row.turned) square += component * component;
        ASSERT_NEAR(square, 1, 1e-12) << text;
      }
    } catch (const InputError&) {
    }
  }
}

}  // namespace
}  // namespace filiform
