// Public circuits and morphologies, against figures of an independent reading by h5py and numpy.
#include "index/query/cell_graph.h"
#include "index/set/tile_set.h"
#include "tests/support/corpus.h"
#include "tests/support/process.h"
#include "tests/support/scenes/circuit_figures.h"
#include "tests/support/temp_folder.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::expectFigures;
using test::figuresOf;
using test::ingestFine;
using test::Outcome;
using test::runFiliform;
using test::TempFolder;

fs::path fixtures() { return *test::corpusFolder() / "circuits"; }

#define FILIFORM_NEEDS_CIRCUITS() \
  FILIFORM_NEEDS_CORPUS();        \
  if (!fs::is_directory(fixtures())) GTEST_SKIP() << "the corpus has no circuits/"

TEST(CircuitFixtures, TenCellsFromAContainer) {
  FILIFORM_NEEDS_CIRCUITS();
  const TempFolder folder;
  const std::string config = fixtures() / "obi-one/tiny_circuits/N_10__top_nodes_dim6/circuit_config.json";
  const Outcome made = ingestFine({config}, folder / "a.fil");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("length 0.99991"), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("population POm (virtual): 153 nodes"), std::string::npos) << made.out;
  expectFigures(folder / "a.fil", 10, 169443, 282113.80871757, {2406.563313105, -2205.669451505, -3716.202667223},
                {4660.478771599, 862.420749472, -1781.762230916});
  const nlohmann::json figures = figuresOf(config);
  if (!figures.is_null()) expectFigures(folder / "a.fil", figures);
}

TEST(CircuitFixtures, TwoCellsFromSwcFiles) {
  FILIFORM_NEEDS_CIRCUITS();
  const TempFolder folder;
  const std::string config = fixtures() / "obi-one/tiny_circuits/nbS1-O1-E2Sst-maxNsyn-HEX0-L5/circuit_config.json";
  const Outcome made = ingestFine({config}, folder / "a.fil");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  expectFigures(folder / "a.fil", 2, 27804, 49905.85208984, {3472.667957342, -2056.442023829, -3021.829788833},
                {4583.749051157, -435.552345315, -1614.189067344});
}

TEST(CircuitFixtures, ThreeHundredCellsWithTypesInATable) {
  FILIFORM_NEEDS_CIRCUITS();
  const TempFolder folder;
  const Outcome made = ingestFine({fixtures() / "sonata/examples/300_cells/circuit_config.json"}, folder / "a.fil");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("W_SOMA_OFFSET 1"), std::string::npos) << made.out;  // a soma 335 um from the origin
  expectFigures(folder / "a.fil", 300, 696400, 865392.36330544, {-196.265870588, -235.810259076, -211.955030948},
                {216.247902491, 525.051334360, 219.145708745});
}

TEST(CircuitFixtures, OtherPublicFilesAreReadOrRefusedInOneLine) {
  FILIFORM_NEEDS_CIRCUITS();
  const std::string swc = fixtures() / "sonata/examples/shared_components/morphologies";
  const std::string snap = fixtures() / "snap/tests/data";
  const std::string types = fixtures() / "sonata/examples/layer4_sample/network/l4_node_types.csv";
  struct Case {
    std::vector<std::string> arguments;
    int exit_code;
    std::string words;
  };
  const std::vector<Case> cases{
      {{snap + "/nodes_quaternions.h5", "--morphologies", snap + "/morphologies/container-morphs.h5"},
       0,
       "3 nodes, 2 placed, 0 without a morphology, 1 whose morphology is missing; mean direction of local +y (0.000, "
       "0.500, 0.500), length 0.70711"},
      {{snap + "/nodes_quaternions_w_missing.h5", "--morphologies", snap + "/morphologies/container-morphs.h5"},
       1,
       "3 of the four"},
      {{snap + "/nodes_no_rotation.h5", "--morphologies", snap + "/morphologies/container-morphs.h5"}, 0, "3 nodes"},
      {{snap + "/nodes_with_library_small.h5", "--morphologies", snap + "/morphologies/container-morphs.h5"},
       1,
       "places none of its 7 nodes: none has a morphology"},
      {{fixtures() / "sonata/examples/300_intfire/network/v1_nodes.h5", "--morphologies", swc},
       1,
       "none of its 300 nodes"},
      {{fixtures() / "sonata/src/pysonata/sonata/tests/circuit/examples/v1_nodes.h5", "--morphologies", swc},
       1,
       "none of its 449 nodes"},
      {{fixtures() / "sonata/examples/layer4_sample/network/lgn_nodes.h5", "--morphologies", swc},
       1,
       "none of its 9000 nodes"},
  };
  for (const Case& one : cases) {
    std::vector<std::string> arguments = one.arguments;
    arguments.insert(arguments.begin(), "check");
    const Outcome outcome = runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, one.exit_code) << one.arguments[0] << outcome.err << outcome.out;
    EXPECT_NE((outcome.out + outcome.err).find(one.words), std::string::npos) << one.arguments[0] << '\n'
                                                                              << outcome.out << outcome.err;
  }
}

// The same cell in SWC and H5: the same neurites. The soma differs: 21 samples in SWC, one sphere from its outline in
// H5. The SWC file repeats the last point of a section as the first of each child; H5 and ASC keep one of the two.
// Hence only segments with a length are counted.
TEST(CircuitFixtures, OneCellInTwoFormatsIsTheSameTree) {
  FILIFORM_NEEDS_CIRCUITS();
  const TempFolder folder;
  struct Tree {
    std::uint64_t neurite_segments = 0, branches = 0, tips = 0;
    double length_um = 0;
  };
  std::vector<Tree> trees;
  for (const char* const ending : {".swc", ".h5", ".asc"}) {
    const std::string file = fixtures() / (std::string("obi-one/morphologies/C060114A5") + ending);
    const Outcome made = ingestFine({file}, folder / (std::string("set") + ending + ".fil"));
    if (std::string(ending) == ".asc" && made.exit_code != 0) continue;  // this build has no reader of ASC
    ASSERT_EQ(made.exit_code, 0) << made.err;
    const auto set = TileSet::open(folder / (std::string("set") + ending + ".fil"));
    const CellGraph graph = readCell(*set, 0, true);
    Tree tree;
    std::vector<int> children(graph.samples(), 0);
    const auto neurite = [&](std::uint32_t i) { return graph.types[i] != 1; };
    for (std::uint32_t i = 0; i < graph.samples(); ++i) {
      const std::uint32_t parent = graph.parents[i];
      if (parent == kNoParent || !neurite(i) || !neurite(parent)) continue;
      ++children[parent];
      const double length_um = (graph.position_W(i) - graph.position_W(parent)).norm();
      tree.neurite_segments += length_um > 0;
      tree.length_um += length_um;
    }
    for (std::uint32_t i = 0; i < graph.samples(); ++i) {
      tree.branches += children[i] > 1;
      tree.tips += neurite(i) && children[i] == 0;
    }
    trees.push_back(tree);
  }
  ASSERT_GE(trees.size(), 2u);
  for (const Tree& tree : trees) {
    EXPECT_EQ(tree.neurite_segments, trees[0].neurite_segments);
    EXPECT_EQ(tree.branches, trees[0].branches);
    EXPECT_EQ(tree.tips, trees[0].tips);
    EXPECT_NEAR(tree.length_um / trees[0].length_um, 1, 1e-4);
  }
}

}  // namespace
}  // namespace filiform
