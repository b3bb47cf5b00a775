#include "tools/synthetic/synthetic.h"

#include "index/errors.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_entries.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <signal.h>
#include <sstream>
#include <stdlib.h>
#include <sys/resource.h>
#include <time.h>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using test::entriesOf;

std::vector<Cell> cellsOf(const SyntheticOptions& options, const std::string& archive = "") {
  SyntheticCells stream(options, archive);
  std::vector<Cell> out;
  for (Cell cell; stream.next(cell);) out.push_back(std::move(cell));
  return out;
}

SyntheticOptions column(std::uint32_t cells, std::uint64_t seed = 1) {
  SyntheticOptions options;
  options.cells = cells;
  options.seed = seed;
  return options;
}

SyntheticOptions scene(const std::string& kind) {
  SyntheticOptions options;
  options.kind = kind;
  return options;
}

TEST(Synthetic, TheSameOptionsGiveTheSameBytes) {
  const test::TempFolder folder;
  writeSynthetic(column(4), folder.file("a.zip"));
  // The dates in an archive must not follow the local time zone.
  const char* old_zone = getenv("TZ");
  const std::string zone = old_zone == nullptr ? "" : old_zone;
  setenv("TZ", "Asia/Tokyo", 1);
  tzset();
  writeSynthetic(column(4), folder.file("b.zip"));
  if (old_zone == nullptr) {
    unsetenv("TZ");
  } else {
    setenv("TZ", zone.c_str(), 1);
  }
  tzset();
  writeSynthetic(column(4, 2), folder.file("c.zip"));
  EXPECT_TRUE(test::readBytes(folder.file("a.zip")) == test::readBytes(folder.file("b.zip")));
  EXPECT_FALSE(test::readBytes(folder.file("a.zip")) == test::readBytes(folder.file("c.zip")));
}

TEST(Synthetic, AColumnKeepsItsFirstCellsWhenItGrows) {
  const auto small = cellsOf(column(3));
  const auto large = cellsOf(column(12));
  for (const Cell& cell : small) {
    const auto found =
        std::find_if(large.begin(), large.end(), [&](const Cell& other) { return other.source == cell.source; });
    ASSERT_NE(found, large.end()) << cell.source;
    EXPECT_EQ(found->digest, cell.digest);
  }
}

TEST(Synthetic, TheStreamIsWhatAReaderOfTheArchiveWouldGet) {
  const test::TempFolder folder;
  for (const SyntheticOptions& options : {column(6), scene("scene1"), scene("scene3")}) {
    const SyntheticSummary summary = writeSynthetic(options, folder.file("a.zip"));
    const auto entries = entriesOf(folder.file("a.zip"));
    const auto cells = cellsOf(options, "a.zip");
    ASSERT_EQ(entries.size(), cells.size());
    EXPECT_EQ(summary.files, cells.size());
    EXPECT_EQ(summary.zip_bytes, std::filesystem::file_size(folder.file("a.zip")));
    std::uint64_t samples = 0, segments = 0, text_bytes = 0;
    std::string before;
    for (const Cell& cell : cells) {
      EXPECT_LT(before, cell.source) << "in the order of cell ids";
      before = cell.source;
      ASSERT_EQ(cell.source.rfind("a.zip/", 0), 0U);
      const std::string& text = entries.at(cell.source.substr(6));
      text_bytes += text.size();
      std::istringstream lines(text);
      std::size_t i = 0;
      for (std::string line; std::getline(lines, line);) {
        if (line[0] == '#') continue;
        std::istringstream fields(line);
        std::int64_t id = 0, parent = 0;
        int type = 0;
        std::string x, y, z, radius;
        fields >> id >> type >> x >> y >> z >> radius >> parent;
        ASSERT_TRUE(fields) << line;
        ASSERT_LT(i, cell.samples());
        ASSERT_EQ(cell.sample_ids[i], id);
        ASSERT_EQ(cell.types[i], type);
        int axis = 0;
        for (const std::string& word : {x, y, z}) {
          ASSERT_EQ(word.size() - word.find('.'), 4U) << "three decimals: " << line;
          double value = 0;
          std::from_chars(word.data(), word.data() + word.size(), value);
          ASSERT_EQ(cell.positions_um[i][axis++], value);
        }
        float r = 0;
        std::from_chars(radius.data(), radius.data() + radius.size(), r);
        ASSERT_EQ(cell.radii_um[i], r);
        ASSERT_EQ(cell.parents[i], parent < 0 ? kNoParent : static_cast<std::uint32_t>(parent - 1));
        ++i;
        segments += parent < 0 ? 0 : 1;
      }
      EXPECT_EQ(i, cell.samples());
      samples += i;
    }
    EXPECT_EQ(summary.samples, samples);
    EXPECT_EQ(summary.segments, segments);
    EXPECT_EQ(summary.text_bytes, text_bytes);
  }
}

TEST(Synthetic, CellsLookLikeNeuronsInAColumn) {
  const auto cells = cellsOf(column(60));
  std::vector<std::size_t> sizes;
  std::map<char, int> by_layer;
  for (const Cell& cell : cells) {
    SCOPED_TRACE(cell.source);
    sizes.push_back(cell.samples() - 1);
    by_layer[cell.source[cell.source.find("/L") + 2]]++;
    ASSERT_EQ(cell.types[0], 1);
    ASSERT_EQ(cell.parents[0], kNoParent);
    ASSERT_EQ(cell.types[1], 1);
    ASSERT_EQ(cell.types[2], 1);
    const Vector3d soma = cell.positions_um[0];
    EXPECT_LE(std::hypot(soma.x(), soma.z()), 150.01);
    EXPECT_GT(soma.y(), 0);
    EXPECT_LT(soma.y(), 1400);
    std::set<int> types;
    std::vector<int> children(cell.samples(), 0);
    for (std::size_t i = 3; i < cell.samples(); ++i) {
      types.insert(cell.types[i]);
      const std::uint32_t parent = cell.parents[i];
      ASSERT_LT(parent, i);
      ++children[parent];
      ASSERT_GT(cell.radii_um[i], 0.1F);
      ASSERT_LT(cell.positions_um[i].y(), 1400) << "through the pia";
      ASSERT_LT((cell.positions_um[i] - soma).norm(), 1700);
      if (parent == 0) continue;  // from the soma's centre to its surface
      const double length = (cell.positions_um[i] - cell.positions_um[parent]).norm();
      ASSERT_GE(length, 0.995);
      ASSERT_LE(length, 6.005);
      ASSERT_LE(cell.radii_um[i], cell.radii_um[parent] + 0.0011F) << "neurites do not thicken";
    }
    EXPECT_TRUE(types.contains(2) && types.contains(3)) << "an axon and dendrites";
    EXPECT_LE(*std::max_element(children.begin() + 1, children.end()), 3);
    EXPECT_GT(std::count_if(children.begin() + 1, children.end(), [](int n) { return n > 1; }), 10) << "it branches";
  }
  std::sort(sizes.begin(), sizes.end());
  EXPECT_GT(sizes[30], 3200U);
  EXPECT_LT(sizes[30], 4800U);
  EXPECT_GT(sizes.front(), 1500U);
  EXPECT_LT(sizes.back(), 15000U);
  EXPECT_GT(by_layer['6'], by_layer['2']);
  EXPECT_GT(by_layer['2'], 0);
}

TEST(Synthetic, PyramidalCellsReachThePiaAndTheWhiteMatter) {
  int tufted = 0;
  for (const Cell& cell : cellsOf(column(60))) {
    if (cell.source.find("/L5/") == std::string::npos) continue;
    double apical_top = -1e9, axon_bottom = 1e9;
    for (std::size_t i = 0; i < cell.samples(); ++i) {
      if (cell.types[i] == 4) apical_top = std::max(apical_top, cell.positions_um[i].y());
      if (cell.types[i] == 2) axon_bottom = std::min(axon_bottom, cell.positions_um[i].y());
    }
    if (apical_top < 0) continue;  // an interneuron
    ++tufted;
    EXPECT_GT(apical_top, 1270) << cell.source << " ends below L1";
    EXPECT_LT(axon_bottom, -30) << cell.source;
  }
  EXPECT_GT(tufted, 3);
}

TEST(Synthetic, DendritesOfStellateAndBasketCellsBalance) {
  double sum = 0;
  int cells = 0;
  for (const Cell& cell : cellsOf(column(80))) {
    if (std::count(cell.types.begin(), cell.types.end(), 4) > 0) continue;
    Vector3d mean = Vector3d::Zero();
    double reach = 0;
    int n = 0;
    for (std::size_t i = 3; i < cell.samples(); ++i) {
      if (cell.types[i] != 3) continue;
      mean += cell.positions_um[i] - cell.positions_um[0];
      reach += (cell.positions_um[i] - cell.positions_um[0]).norm();
      ++n;
    }
    ASSERT_GT(n, 0);
    sum += mean.norm() / reach;
    ++cells;
  }
  ASSERT_GT(cells, 10);
  EXPECT_LT(sum / cells, 0.3) << "0: as much on every side; 1: all on one side";
}

std::vector<int> childCounts(const Cell& cell) {
  std::vector<int> children(cell.samples(), 0);
  for (std::size_t i = 1; i < cell.samples(); ++i) ++children[cell.parents[i]];
  return children;
}

// The samples from the root to the tip of the scene's route.
std::vector<std::uint32_t> routeOf(const Cell& cell, const std::string& kind) {
  std::vector<std::uint32_t> route;
  for (auto i = static_cast<std::uint32_t>(std::stoul(sceneRoute(kind).substr(2)) - 1); i != kNoParent;
       i = cell.parents[i])
    route.insert(route.begin(), i);
  return route;
}

double turn_rad(const Vector3d& in, const Vector3d& out) { return std::atan2(in.cross(out).norm(), in.dot(out)); }

TEST(Synthetic, SceneOneIsAPathWithSharpElbowsAndElbowsTheSameRounded) {
  for (const std::string kind : {"scene1", "elbows"}) {
    SCOPED_TRACE(kind);
    const Cell one = cellsOf(scene(kind)).at(0);
    const std::vector<int> children = childCounts(one);
    EXPECT_EQ(*std::max_element(children.begin(), children.end()), 1) << "no branches";
    EXPECT_EQ(sceneRoute(kind), "1:" + std::to_string(one.samples()));
    int right_angles = 0, turned_back = 0;
    for (std::size_t i = 8; i + 8 < one.samples(); ++i) {
      const auto& p = one.positions_um;
      right_angles += turn_rad(p[i] - p[i - 1], p[i + 1] - p[i]) > 1.57 ? 1 : 0;
      turned_back += (p[i] - p[i - 8]).dot(p[i + 8] - p[i]) < 0 ? 1 : 0;
    }
    EXPECT_EQ(right_angles, kind == "scene1" ? 8 : 0);
    EXPECT_GE(turned_back, 8);
  }
}

TEST(Synthetic, ScenesTwoAndThreeAreTwoWaysThroughOneStructure) {
  const Cell easy = cellsOf(scene("scene2")).at(0), hard = cellsOf(scene("scene3")).at(0);
  EXPECT_EQ(easy.positions_um, hard.positions_um);
  EXPECT_EQ(easy.parents, hard.parents);
  EXPECT_NE(sceneRoute("scene2"), sceneRoute("scene3"));
  const std::vector<int> children = childCounts(easy);
  // The number of branches met on the way, and the sharpest turn.
  const auto branching = [&](const std::string& kind) {
    std::vector<int> met;
    const std::vector<std::uint32_t> route = routeOf(easy, kind);
    for (const std::uint32_t i : route)
      if (children[i] > 1) met.push_back(children[i]);
    return met;
  };
  EXPECT_EQ(branching("scene2"), (std::vector<int>{2, 2}));
  EXPECT_EQ(branching("scene3"), (std::vector<int>{2, 5, 3}));
  const auto sharp = [&](const std::string& kind) {
    int turns = 0;
    const std::vector<std::uint32_t> route = routeOf(easy, kind);
    const auto& p = easy.positions_um;
    for (std::size_t i = 1; i + 1 < route.size(); ++i)
      turns += turn_rad(p[route[i]] - p[route[i - 1]], p[route[i + 1]] - p[route[i]]) > 1.57 ? 1 : 0;
    return turns;
  };
  EXPECT_EQ(sharp("scene2"), 0);
  EXPECT_EQ(sharp("scene3"), 2);
  // At the nodes with five and three branches, the other branches leave at .2 rad from the route.
  const std::vector<std::uint32_t> route = routeOf(easy, "scene3");
  for (std::size_t k = 0; k + 1 < route.size(); ++k) {
    if (children[route[k]] < 3) continue;
    const auto direction = [&](std::uint32_t i) -> Vector3d {
      return easy.positions_um[i] - easy.positions_um[route[k]];
    };
    for (std::uint32_t i = 1; i < easy.samples(); ++i) {
      if (easy.parents[i] != route[k] || i == route[k + 1]) continue;
      EXPECT_NEAR(turn_rad(direction(route[k + 1]), direction(i)), 0.2, 0.01);
    }
  }
}

TEST(Synthetic, EverySceneEndsAtATipAndItsFileNamesItsRoute) {
  for (const std::string& kind : syntheticKinds()) {
    if (kind == "column" || kind == "traces" || kind == "fan") continue;
    SCOPED_TRACE(kind);
    const Cell cell = cellsOf(scene(kind)).at(0);
    const std::string route = sceneRoute(kind);
    EXPECT_EQ(childCounts(cell).at(std::stoul(route.substr(2)) - 1), 0);
    const test::TempFolder folder;
    writeSynthetic(scene(kind), folder.file("s.zip"));
    EXPECT_NE(entriesOf(folder.file("s.zip")).at(kind + ".swc").find("ROOT:TIP): " + route + "\n"), std::string::npos);
  }
}

TEST(Synthetic, FansAreCellsOfTheirOwn) {
  SyntheticOptions options = column(6, 9);
  options.kind = "fan";
  const std::vector<Cell> fans = cellsOf(options);
  ASSERT_EQ(fans.size(), 6U);
  for (std::size_t i = 0; i < fans.size(); ++i) {
    const std::vector<int> children = childCounts(fans[i]);
    EXPECT_EQ(*std::max_element(children.begin(), children.end()), (std::vector<int>{3, 5, 7, 10, 3, 5}[i]));
    EXPECT_NE(fans[i].source.find("fan"), std::string::npos);
  }
  const test::TempFolder folder;
  EXPECT_EQ(writeSynthetic(options, folder.file("f.zip")).files, 6U);
  EXPECT_NE(entriesOf(folder.file("f.zip")).at("fan/fan_00003.swc").find("route (sample ids ROOT:TIP): 1:"),
            std::string::npos);
}

TEST(Synthetic, APlacementTableUsesALibrary) {
  const test::TempFolder folder;
  SyntheticOptions options = column(25);
  options.library = 4;
  options.placements_out = folder.file("t.tsv");
  const SyntheticSummary summary = writeSynthetic(options, folder.file("lib.zip"));
  EXPECT_EQ(summary.cells, 25U);
  EXPECT_EQ(summary.files, 4U);
  const auto entries = entriesOf(folder.file("lib.zip"));
  std::istringstream lines(test::readBytes(folder.file("t.tsv")));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "source\tx_um\ty_um\tz_um\tqw\tqx\tqy\tqz\tname");
  std::set<std::string> used, names;
  while (std::getline(lines, line)) {
    std::istringstream fields(line);
    std::string source, name;
    double x = 0, y = 0, z = 0, qw = 0, qx = 0, qy = 0, qz = 0;
    fields >> source >> x >> y >> z >> qw >> qx >> qy >> qz >> name;
    ASSERT_TRUE(fields) << line;
    ASSERT_EQ(source.rfind("lib.zip/", 0), 0U);
    EXPECT_TRUE(entries.contains(source.substr(8))) << source;
    EXPECT_LE(std::hypot(x, z), 257.01);
    EXPECT_NEAR(qw * qw + qx * qx + qy * qy + qz * qz, 1, 1e-12);
    EXPECT_EQ(qx, 0);
    EXPECT_EQ(qz, 0) << "turned about the vertical only";
    used.insert(source);
    names.insert(name);
  }
  EXPECT_EQ(used.size(), 4U);
  EXPECT_EQ(names.size(), 25U);
}

TEST(Synthetic, RefusesWhatItCannotMake) {
  const test::TempFolder folder;
  EXPECT_THROW(writeSynthetic(column(0), folder.file("a.zip")), UsageError);
  EXPECT_THROW(writeSynthetic(scene("scene4"), folder.file("a.zip")), UsageError);
  EXPECT_THROW(SyntheticCells(scene("")), UsageError);
  EXPECT_THROW(sceneRoute("column"), UsageError);
  EXPECT_THROW(sceneRoute("scene9"), UsageError);
  EXPECT_THROW(writeSynthetic(column(1), folder.file("no/such/folder/a.zip")), IoError);
  EXPECT_THROW(writeSynthetic(column(1), folder.path()), IoError) << "a folder";
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Synthetic, AnOldArchiveStaysUntilTheNewOneIsWhole) {
  const test::TempFolder folder;
  writeSynthetic(column(2), folder.file("a.zip"));
  const std::string old = test::readBytes(folder.file("a.zip"));
  struct Stop {};
  SyntheticOptions options = column(5, 9);
  options.placements_out = folder.file("t.tsv");
  EXPECT_THROW(writeSynthetic(options, folder.file("a.zip"),
                              [](std::uint64_t done, std::uint64_t total) {
                                EXPECT_EQ(total, 5U);
                                if (done == 3) throw Stop();
                              }),
               Stop);
  EXPECT_TRUE(test::readBytes(folder.file("a.zip")) == old);

  const auto old_handler = signal(SIGXFSZ, SIG_IGN);
  rlimit old_limit{};
  getrlimit(RLIMIT_FSIZE, &old_limit);
  const rlimit small{30000, old_limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(writeSynthetic(options, folder.file("a.zip")), IoError) << "as on a full disk";
  setrlimit(RLIMIT_FSIZE, &old_limit);
  signal(SIGXFSZ, old_handler);
  EXPECT_TRUE(test::readBytes(folder.file("a.zip")) == old);
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) ++files;
  EXPECT_EQ(files, 1U) << "nothing half-written";
}

}  // namespace
}  // namespace filiform::tools
